#include "laban/motion/stored_rig.h"

#include <cmath>

namespace laban::motion {
namespace {

using base::Container;
using Eigen::Index;
using Eigen::MatrixXd;

Eigen::Vector4d wxyz(const Eigen::Quaterniond& q) {
  return {q.w(), q.x(), q.y(), q.z()};
}

/// Rig joint (-1: none) and reference rotation of each standard joint.
MatrixXd mapping_array(const Humanoid& humanoid) {
  MatrixXd mapped(5, kStandardJointCount);
  for (int s = 0; s < kStandardJointCount; ++s) {
    const auto& joint = humanoid.mapped(static_cast<StandardJoint>(s));
    mapped.col(s) << (joint ? joint->joint : -1),
        wxyz(joint ? joint->reference : Eigen::Quaterniond::Identity());
  }
  return mapped;
}

Humanoid::Mapping load_mapping(const PartReader& reader, Index joints) {
  const MatrixXd values = reader.matrix("rig.mapped", 5, kStandardJointCount);
  const std::vector<int> played =
      reader.whole(values.row(0), -1.0, static_cast<double>(joints) - 1.0,
                   "its rig maps a joint that it does not have");
  Humanoid::Mapping mapping;
  for (std::size_t s = 0; s < played.size(); ++s) {
    if (played[s] < 0) continue;
    mapping[s] =
        MappedJoint{played[s], reader.rotation(values.col(static_cast<Index>(s)).tail<4>())};
  }
  return mapping;
}

std::shared_ptr<const Skeleton> load_skeleton(const PartReader& reader,
                                              const std::vector<std::string>& names) {
  const auto joints = static_cast<Index>(names.size());
  const auto parents = reader.whole("rig.parents", joints, -1.0, static_cast<double>(joints) - 1.0);
  const MatrixXd offsets = reader.matrix("rig.offsets", 3, joints);
  const MatrixXd ends = reader.matrix("rig.end_sites", 4, joints);
  std::vector<Joint> list;
  for (Index j = 0; j < joints; ++j) {
    const auto cell = static_cast<std::size_t>(j);
    Joint joint{names[cell], parents[cell], offsets.col(j), std::nullopt};
    if (ends(3, j) != 0.0) joint.end_site = Eigen::Vector3d(ends.col(j).head<3>());
    list.push_back(std::move(joint));
  }
  return std::make_shared<const Skeleton>(std::move(list));
}

Clip load_stance(const PartReader& reader, const StoredRigHeader& header, double rate_hz) {
  auto skeleton = load_skeleton(reader, header.joints);
  const Index joints = skeleton->joint_count();
  const MatrixXd values = reader.matrix("rig.stance", 7, joints);
  std::vector<Eigen::Quaterniond> rotations;
  for (Index j = 0; j < joints; ++j) {
    rotations.push_back(reader.rotation(values.col(j).head<4>()));
  }
  Eigen::Matrix3Xd translations;
  if (header.animates_translations) translations = values.bottomRows<3>();
  return {std::move(skeleton), rate_hz, values.col(0).tail<3>(), std::move(rotations),
          std::move(translations)};
}

}  // namespace

base::Array to_array(const Eigen::Ref<const MatrixXd>& matrix) {
  base::Array array{static_cast<int>(matrix.rows()), static_cast<int>(matrix.cols()), {}};
  array.values.resize(static_cast<std::size_t>(matrix.size()));
  Eigen::Map<MatrixXd>(array.values.data(), matrix.rows(), matrix.cols()) = matrix;
  return array;
}

base::Array to_array(const std::vector<int>& values) {
  base::Array array{1, static_cast<int>(values.size()), {}};
  array.values.assign(values.begin(), values.end());
  return array;
}

void PartReader::require(bool holds, const std::string& what) const {
  if (holds) return;
  throw base::Error(base::ErrorKind::kFormat,
                    std::string(name_) + ": " + what + "; " + std::string(mend_));
}

MatrixXd PartReader::matrix(const std::string& array, Index rows, Index cols) const {
  const base::Array& found = container_.array(array);
  require((rows < 0 || found.rows == rows) && (cols < 0 || found.cols == cols),
          "array '" + array + "' is " + std::to_string(found.rows) + " x " +
              std::to_string(found.cols) + ", which does not fit the others");
  MatrixXd values = Eigen::Map<const MatrixXd>(found.values.data(), found.rows, found.cols);
  require(values.size() == 0 || values.cwiseAbs().maxCoeff() <= kMaxValue,
          "array '" + array + "' holds values beyond all measure");
  return values;
}

std::vector<int> PartReader::whole(const std::string& array, Index count, double low,
                                   double high) const {
  return whole(matrix(array, 1, count).row(0), low, high,
               "array '" + array + "' holds a number out of range");
}

std::vector<int> PartReader::whole(const Eigen::Ref<const Eigen::RowVectorXd>& values, double low,
                                   double high, const std::string& what) const {
  std::vector<int> numbers;
  for (const double value : values) {
    require(value >= low && value <= high && value == std::floor(value), what);
    numbers.push_back(static_cast<int>(value));
  }
  return numbers;
}

Eigen::Quaterniond PartReader::rotation(const Eigen::Vector4d& values) const {
  const Eigen::Quaterniond q(values[0], values[1], values[2], values[3]);
  require(std::abs(q.squaredNorm() - 1.0) <= 1e-9, "a rotation of its rig has not length 1");
  return q;
}

double PartReader::leg_length(double metres) const {
  require(metres > 0.0 && metres <= kMaxValue, "a leg length must be positive, in metres");
  return metres;
}

double PartReader::frame_rate(double hz) const {
  constexpr double kMaxRate = 1e6;
  require(hz > 0.0 && hz <= kMaxRate, "the frame rate must be positive, at most 1e6 Hz");
  return hz;
}

StoredRigHeader save_rig(const StoredRig& rig, Container& container) {
  const Skeleton& skeleton = rig.stance.skeleton();
  const Index joints = skeleton.joint_count();
  MatrixXd offsets(3, joints);
  MatrixXd ends(4, joints);  // the last row says whether there is one
  MatrixXd stance(7, joints);
  std::vector<int> parents;
  StoredRigHeader header;
  for (int j = 0; j < joints; ++j) {
    const Joint& joint = skeleton.joint(j);
    header.joints.push_back(joint.name);
    parents.push_back(joint.parent);
    offsets.col(j) = joint.rest_offset;
    ends.col(j) << joint.end_site.value_or(Eigen::Vector3d::Zero()), joint.end_site ? 1.0 : 0.0;
    stance.col(j) << wxyz(rig.stance.rotation(0, j)), rig.stance.translation(0, j);
  }
  container.arrays["rig.parents"] = to_array(parents);
  container.arrays["rig.offsets"] = to_array(offsets);
  container.arrays["rig.end_sites"] = to_array(ends);
  container.arrays["rig.stance"] = to_array(stance);
  container.arrays["rig.mapped"] = to_array(mapping_array(rig.humanoid));
  container.arrays["rig.root_point"] = to_array(rig.humanoid.root_point());
  header.name = rig.humanoid.rig_name();
  header.leg_length_m = rig.humanoid.leg_length_m();
  header.animates_translations = rig.stance.has_translations();
  if (rig.floor) header.floor_m = {rig.floor->heel_m, rig.floor->toe_m};
  return header;
}

StoredRig load_rig(const PartReader& reader, const StoredRigHeader& header, double rate_hz) {
  Clip stance = load_stance(reader, header, rate_hz);
  const Humanoid::Mapping mapping = load_mapping(reader, stance.joint_count());
  Humanoid humanoid(header.name, stance.skeleton(), mapping, reader.leg_length(header.leg_length_m),
                    reader.matrix("rig.root_point", 3, 1), 0);
  StoredRig rig{std::move(stance), std::move(humanoid), std::nullopt};
  if (header.floor_m) {
    const auto [heel_m, toe_m] = *header.floor_m;
    reader.require(
        std::abs(heel_m) <= PartReader::kMaxValue && std::abs(toe_m) <= PartReader::kMaxValue,
        "its floor lies beyond all measure");
    rig.floor = FootFloor{heel_m, toe_m};
  }
  return rig;
}

}  // namespace laban::motion
