#include "laban/io/motion_table.h"

#include <array>
#include <bit>
#include <cstdint>
#include <cstring>
#include <set>

#include <nlohmann/json.hpp>

#include "laban/base/csv.h"
#include "laban/base/error.h"
#include "laban/motion/forward_kinematics.h"
#include "laban/motion/standard_joint.h"

namespace laban::io {
namespace {

static_assert(std::endian::native == std::endian::little, "NPY records are little-endian");

constexpr std::array<const char*, 3> kAxes = {"x", "y", "z"};

/// Names that no other column has: a repeated one gets its joint's number.
std::vector<std::string> column_names(const motion::Skeleton& skeleton) {
  std::set<std::string> taken;
  std::vector<std::string> names;
  for (int j = 0; j < skeleton.joint_count(); ++j) {
    std::string name = skeleton.joint(j).name;
    while (!taken.insert(name).second) name += "_" + std::to_string(j);
    names.push_back(std::move(name));
  }
  return names;
}

double time_s(const MotionTable& table, Eigen::Index frame) {
  return static_cast<double>(frame) / table.frame_rate_hz;
}

/// A string literal of Python in ASCII; JSON's are.
std::string python_string(const std::string& text) {
  return nlohmann::json(text).dump(-1, ' ', true, nlohmann::json::error_handler_t::replace);
}

std::string npy_header(const MotionTable& table) {
  std::string fields =
      "(('frame_rate_hz=" + base::format_number(table.frame_rate_hz) + "', 'time_s'), '<f8')";
  for (const std::string& column : table.columns) {
    fields += ", (" + python_string(column) + ", '<f8')";
  }
  return "{'descr': [" + fields + "], 'fortran_order': False, 'shape': (" +
         std::to_string(table.values.cols()) + ",), }";
}

void append_bytes(std::string& bytes, const void* data, std::size_t size) {
  const std::size_t old = bytes.size();
  bytes.resize(old + size);
  std::memcpy(bytes.data() + old, data, size);
}

}  // namespace

MotionTable joint_position_table(const motion::Clip& clip) {
  MotionTable table{"joint positions", clip.frame_rate_hz(), {}, {}};
  for (const std::string& name : column_names(clip.skeleton())) {
    for (const char* axis : kAxes) table.columns.push_back(name + "_" + axis + "_m");
  }
  table.values = motion::joint_positions(clip).reshaped(3 * clip.joint_count(), clip.frame_count());
  return table;
}

MotionTable pose_table(const motion::PoseMatrix& pose) {
  MotionTable table{"pose matrix", pose.frame_rate_hz, {}, {}};
  for (const std::string_view joint : motion::kStandardJointNames) {
    for (const char* axis : kAxes) {
      table.columns.push_back(std::string(joint) + "_" + axis + "_rad");
    }
  }
  for (const char* name : {"height_leg", "step_x_leg", "step_z_leg", "step_yaw_rad"}) {
    table.columns.emplace_back(name);
  }
  table.values.resize(motion::kAngleRowCount + 4, pose.frame_count());
  table.values << pose.angles, pose.height, pose.steps;
  return table;
}

std::string format_csv(const MotionTable& table) {
  std::string text = "# laban: " + table.title +
                     ", frame_rate_hz=" + base::format_number(table.frame_rate_hz) + "\n";
  std::vector<std::string> row = {"time_s"};
  row.insert(row.end(), table.columns.begin(), table.columns.end());
  text += base::format_csv_row(row);
  for (Eigen::Index f = 0; f < table.values.cols(); ++f) {
    row.assign(1, base::format_number(time_s(table, f)));
    for (const double value : table.values.col(f)) row.push_back(base::format_number(value));
    text += base::format_csv_row(row);
  }
  return text;
}

std::string format_npy(const MotionTable& table) {
  constexpr std::size_t kAlignment = 64;
  constexpr std::size_t kPrefix = 12;  // magic, version, header size
  std::string header = npy_header(table);
  const std::size_t unpadded = kPrefix + header.size() + 1;
  header.append((kAlignment - unpadded % kAlignment) % kAlignment, ' ');
  header += '\n';
  std::string bytes("\x93NUMPY\x02\x00", 8);
  const auto size = static_cast<std::uint32_t>(header.size());
  append_bytes(bytes, &size, sizeof size);
  bytes += header;
  bytes.reserve(bytes.size() + static_cast<std::size_t>(table.values.size() + table.values.cols()) *
                                   sizeof(double));
  for (Eigen::Index f = 0; f < table.values.cols(); ++f) {
    const double time = time_s(table, f);
    append_bytes(bytes, &time, sizeof time);
    append_bytes(bytes, table.values.col(f).data(),
                 static_cast<std::size_t>(table.values.rows()) * sizeof(double));
  }
  return bytes;
}

}  // namespace laban::io
