#include "stage.h"

#include <algorithm>
#include <filesystem>

#include "laban/base/atomic_file.h"

#include "access.h"

namespace laban::studio {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMostClips = 64;

/// A folder that nobody else reads, gone with its files at the end of its scope.
class PrivateFolder {
 public:
  PrivateFolder() : path_(fs::temp_directory_path() / ("laban-" + random_hex(16))) {
    fs::create_directory(path_);
    fs::permissions(path_, fs::perms::owner_all);
  }
  ~PrivateFolder() {
    std::error_code ignored;
    fs::remove_all(path_, ignored);
  }
  PrivateFolder(const PrivateFolder&) = delete;
  PrivateFolder& operator=(const PrivateFolder&) = delete;
  [[nodiscard]] const fs::path& path() const { return path_; }

 private:
  fs::path path_;
};

std::string lower(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(), [](unsigned char c) {
    return c < 128 ? static_cast<char>(std::tolower(c)) : static_cast<char>(c);
  });
  return text;
}

void require_plain_name(const std::string& name) {
  const bool plain = !name.empty() && name.size() <= 255 && name != "." && name != ".." &&
                     std::none_of(name.begin(), name.end(), [](unsigned char c) {
                       return c < 32 || c == '/' || c == '\\' || c == '"' || c == 127;
                     });
  if (!plain) throw HttpError(400, "a file is sent by its name alone, without a folder");
}

}  // namespace

void require_clip_format(const std::string& format) {
  if (format != "bvh" && format != "glb") throw HttpError(400, "a clip is exported as bvh or glb");
}

std::string OpenClip::name() const {
  return fs::path(path).filename().string();
}

std::string OpenClip::made_name(const std::string& made, const std::string& format) const {
  return fs::path(path).stem().string() + "_" + made + "." + format;
}

Routes Stage::routes() {
  return {{"POST /api/clips",
           [this](const Request& request) {
             return json_response(drop(query_value(request, "name"), request.body));
           }},
          {"GET /api/clips/motion",
           [this](const Request& request) { return motion(query_value(request, "clip")); }},
          {"GET /api/clips/mesh",
           [this](const Request& request) { return mesh(query_value(request, "clip")); }},
          {"GET /api/clips/export", [this](const Request& request) {
             return exported(query_value(request, "clip"), query_value(request, "format"));
           }}};
}

const OpenClip& Stage::open(const std::string& path) {
  clips_.push_back({"c" + std::to_string(clips_.size()), path,
                    cli::read_captured_clip(path, reading_, common_)});
  return clips_.back();
}

Json Stage::drop(const std::string& name, const std::string& bytes) {
  require_plain_name(name);
  const std::string ending = lower(fs::path(name).extension().string());
  if (ending == ".asf") {
    skeleton_ = bytes;
    return {{"skeleton", name}};
  }
  if (clips_.size() >= kMostClips)
    throw HttpError(409, "64 clips are open; start the studio again to open more");
  // Beside a file of that name on the disk a skeleton would be found that is not its own.
  if (ending == ".amc" && skeleton_.empty() && reading_.skeleton.empty())
    throw HttpError(400, name + ": AMC motion needs its skeleton; drop its .asf with it");
  cli::CapturedClip clip = ending == ".amc" && !skeleton_.empty()
                               ? read_amc(name, bytes)
                               : cli::parse_captured_clip(name, bytes, reading_, common_);
  clip.record.path = name;
  clips_.push_back({"c" + std::to_string(clips_.size()), name, std::move(clip)});
  return clips_json().back();
}

cli::CapturedClip Stage::read_amc(const std::string& name, const std::string& bytes) const {
  const PrivateFolder folder;
  cli::ReadClipOptions reading = reading_;
  reading.skeleton = (folder.path() / "skeleton.asf").string();
  base::write_file(reading.skeleton, skeleton_);
  return cli::parse_captured_clip(name, bytes, reading, common_);
}

const OpenClip& Stage::at(const std::string& id) const {
  const auto found = std::find_if(clips_.begin(), clips_.end(),
                                  [&](const OpenClip& clip) { return clip.id == id; });
  if (found == clips_.end()) throw HttpError(404, "no such clip is open");
  return *found;
}

Json Stage::clips_json() const {
  Json clips = Json::array();
  for (const OpenClip& clip : clips_) {
    clips.push_back({{"id", clip.id},
                     {"name", clip.name()},
                     {"path", clip.path},
                     {"has_mesh", clip.clip.file.asset != nullptr}});
  }
  return clips;
}

Response Stage::motion(const std::string& id) const {
  const motion::Capture& capture = at(id).clip.capture;
  return {200, "application/x-laban-motion", motion_bytes({capture.clip, capture.humanoid})};
}

Response Stage::mesh(const std::string& id) const {
  const cli::CapturedClip& clip = at(id).clip;
  if (!clip.file.asset) throw HttpError(404, "this clip has no character");
  return {200, "model/gltf-binary",
          cli::clip_bytes("character.glb", clip.file.clip, common_,
                          {clip.file.unit_m, clip.file.asset, {}})};
}

Response Stage::exported(const std::string& id, const std::string& format) const {
  require_clip_format(format);
  const OpenClip& open = at(id);
  const std::string name = fs::path(open.path).stem().string() + "." + format;
  return {200, "application/octet-stream",
          cli::clip_bytes(name, open.clip.file.clip, common_,
                          {open.clip.file.unit_m, open.clip.file.asset, {}}),
          name};
}

}  // namespace laban::studio
