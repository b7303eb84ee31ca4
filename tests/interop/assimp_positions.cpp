// assimp_positions OUT_DIR FILE...: where assimp puts the joints of BVH and GLB files.
//
// Writes OUT_DIR/NAME.assimp.csv for each FILE with the columns frame,time_s,joint,x,y,z (metres; a
// BVH is in centimetres). Joints are the nodes that the animation moves. Exits 1 if a file has not
// one animation with as many keys for each joint.

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <map>
#include <stdexcept>
#include <string>

#include <assimp/Importer.hpp>
#include <assimp/scene.h>

namespace {

constexpr unsigned kSamples = 25;  // forward_kinematics.py picks the same frames

using Channels = std::map<std::string, const aiNodeAnim*>;

Channels channels_of(const aiAnimation& animation) {
  Channels channels;
  for (unsigned c = 0; c < animation.mNumChannels; ++c) {
    const aiNodeAnim* channel = animation.mChannels[c];
    channels[channel->mNodeName.C_Str()] = channel;
    const aiNodeAnim* first = animation.mChannels[0];
    if (channel->mNumRotationKeys != first->mNumRotationKeys || channel->mNumPositionKeys == 0) {
      throw std::runtime_error("joints differ in their number of keys");
    }
  }
  return channels;
}

// What moves no position has one key for it.
aiMatrix4x4 local_matrix(const aiNodeAnim& channel, unsigned frame) {
  const unsigned position = std::min(frame, channel.mNumPositionKeys - 1);
  return aiMatrix4x4(aiVector3D(1, 1, 1), channel.mRotationKeys[frame].mValue,
                     channel.mPositionKeys[position].mValue);
}

class Teller {
 public:
  Teller(const Channels& channels, double seconds_per_tick, double unit_m, std::ofstream& file)
      : channels_(channels), seconds_per_tick_(seconds_per_tick), unit_m_(unit_m), file_(file) {}

  void tell(const aiNode& node, const aiMatrix4x4& parent, unsigned frame) {
    const auto found = channels_.find(node.mName.C_Str());
    const bool moves = found != channels_.end();
    const aiMatrix4x4 world =
        parent * (moves ? local_matrix(*found->second, frame) : node.mTransformation);
    if (moves) {
      const double time_s = found->second->mRotationKeys[frame].mTime * seconds_per_tick_;
      file_ << frame << ',' << time_s << ',' << node.mName.C_Str() << ',' << unit_m_ * world.a4
            << ',' << unit_m_ * world.b4 << ',' << unit_m_ * world.c4 << '\n';
    }
    for (unsigned c = 0; c < node.mNumChildren; ++c) tell(*node.mChildren[c], world, frame);
  }

 private:
  const Channels& channels_;
  double seconds_per_tick_;
  double unit_m_;
  std::ofstream& file_;
};

void tell_file(const std::filesystem::path& path, const std::filesystem::path& out_dir) {
  Assimp::Importer importer;
  const aiScene* scene = importer.ReadFile(path.string(), 0);
  if (scene == nullptr) throw std::runtime_error(importer.GetErrorString());
  if (scene->mNumAnimations != 1 || scene->mAnimations[0]->mNumChannels == 0) {
    throw std::runtime_error("there is not one animation of joints");
  }
  const aiAnimation& animation = *scene->mAnimations[0];
  const Channels channels = channels_of(animation);
  std::ofstream file(out_dir / (path.filename().string() + ".assimp.csv"));
  file << "frame,time_s,joint,x,y,z\n" << std::fixed;
  file.precision(9);
  Teller teller(channels, 1.0 / animation.mTicksPerSecond, path.extension() == ".bvh" ? 0.01 : 1.0,
                file);
  const unsigned last = animation.mChannels[0]->mNumRotationKeys - 1;
  for (unsigned i = 0, next = 0; i < kSamples; ++i) {
    const unsigned frame = i * last / (kSamples - 1);
    if (frame < next) continue;  // told already: fewer frames than samples
    teller.tell(*scene->mRootNode, aiMatrix4x4(), frame);
    next = frame + 1;
  }
}

}  // namespace

int main(int argc, char** argv) {
  int status = 0;
  for (int i = 2; i < argc; ++i) {
    try {
      tell_file(argv[i], argv[1]);
    } catch (const std::exception& error) {
      std::fprintf(stderr, "%s: %s\n", argv[i], error.what());
      status = 1;
    }
  }
  return status;
}
