#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <memory>

#include "laban/base/error.h"
#include "laban/base/huge_pages.h"
#include "laban/io/bvh.h"

#include "io/frame_rate.h"
#include "io/half_angle.h"
#include "io/text_scanner.h"
#include "io/unit_guess.h"
#include "io/warnings.h"

namespace laban::io {
namespace {

// A joint whose positions never leave its OFFSET by more than this does not animate position:
// exporters that write six channels everywhere repeat the OFFSET with float32 noise.
constexpr double kStillOffsetM = 1e-6;

// What the motion may take of memory: so much for each byte of the file, and so much for any file.
// Three channels of one digit are 6 bytes, and 32 bytes a rotation; only a file whose joints mostly
// have no channels gets there.
constexpr double kMemoryPerByte = 12.0;
constexpr double kFreeMemory = 32e6;

// A clip counts its frames in an int.
constexpr std::size_t kMostRows = std::numeric_limits<int>::max();

enum class ChannelKind { kPosition, kRotation, kScale };

struct Channel {
  ChannelKind kind = ChannelKind::kRotation;
  int axis = 0;  // 0 x, 1 y, 2 z

  friend bool operator==(const Channel&, const Channel&) = default;
};

struct DraftJoint {
  std::string_view name;
  int parent = -1;
  std::optional<Eigen::Vector3d> offset;    // file units
  std::optional<Eigen::Vector3d> end_site;  // file units
  std::optional<std::vector<Channel>> channels;
  std::size_t first_column = 0;  // of its channels in a row
  bool has_child = false;
};

struct Hierarchy {
  std::vector<DraftJoint> joints;  // depth first
  std::size_t kept = 0;            // joints of the first root: joints[0, kept)
  std::size_t column_count = 0;    // values a row, of all roots
};

struct Motion {
  double frame_rate_hz = 0.0;
  Eigen::Matrix3Xd root_positions;            // metres
  std::vector<Eigen::Quaterniond> rotations;  // rows * kept joints
  Eigen::Matrix3Xd translations;              // as Clip's: empty if only the root leaves its OFFSET
};

std::optional<Channel> channel_of(std::string_view word) {
  if (word.empty()) return std::nullopt;
  const std::size_t axis = std::string_view("xyzXYZ").find(word.front());
  if (axis == std::string_view::npos) return std::nullopt;
  Channel channel;
  channel.axis = static_cast<int>(axis % 3);
  const std::string_view kind = word.substr(1);
  if (equal_but_for_case(kind, "position")) {
    channel.kind = ChannelKind::kPosition;
  } else if (equal_but_for_case(kind, "rotation")) {
    channel.kind = ChannelKind::kRotation;
  } else if (equal_but_for_case(kind, "scale")) {
    channel.kind = ChannelKind::kScale;
  } else {
    return std::nullopt;
  }
  return channel;
}

/// Reads HIERARCHY up to and including the word MOTION, without recursion.
class HierarchyReader {
 public:
  HierarchyReader(TextScanner& scanner, Warnings& warnings)
      : scanner_(scanner), warnings_(warnings) {}

  [[nodiscard]] Hierarchy read() {
    if (!scanner_.accept_label("hierarchy")) {
      scanner_.skip_space();
      fail("a BVH file begins with HIERARCHY, found " + quoted(scanner_.rest_of_line()));
    }
    while (read_statement()) {
    }
    if (result_.joints.empty()) fail("there is no ROOT before MOTION");
    if (result_.kept == 0) result_.kept = result_.joints.size();
    for (DraftJoint& joint : result_.joints) {
      joint.first_column = result_.column_count;
      if (joint.channels) result_.column_count += joint.channels->size();
    }
    if (result_.column_count == 0) fail("no joint has CHANNELS, so there is no motion to read");
    return std::move(result_);
  }

 private:
  // A block that has been opened and not yet closed.
  struct Block {
    int joint = 0;
    bool is_end_site = false;
    std::size_t begin = 0;
  };

  [[noreturn]] void fail(const std::string& message) const {
    scanner_.fail_at(statement_, message);
  }

  [[nodiscard]] DraftJoint& joint_of_block() {
    return result_.joints[static_cast<std::size_t>(blocks_.back().joint)];
  }

  /// One statement; false after MOTION.
  [[nodiscard]] bool read_statement() {
    scanner_.skip_space();
    statement_ = scanner_.offset();
    const std::string_view word = scanner_.word();
    if (equal_but_for_case(word, "motion")) {
      require_all_closed();
      return false;
    }
    if (word.empty()) {
      require_all_closed();
      fail("the file ends before MOTION; it is cut short or has no motion");
    }
    if (equal_but_for_case(word, "root")) {
      open_root();
    } else if (blocks_.empty()) {
      fail("expected ROOT or MOTION, found " + quoted(word));
    } else if (word == "}") {
      close_block();
    } else if (equal_but_for_case(word, "offset")) {
      read_offset();
    } else if (equal_but_for_case(word, "channels")) {
      read_channels();
    } else if (blocks_.back().is_end_site) {
      fail("expected OFFSET or '}' in an End Site, found " + quoted(word));
    } else if (equal_but_for_case(word, "joint")) {
      open_joint(blocks_.back().joint);
    } else if (equal_but_for_case(word, "end")) {
      open_end_site();
    } else {
      fail("expected OFFSET, CHANNELS, JOINT, End Site or '}', found " + quoted(word));
    }
    return true;
  }

  void require_all_closed() const {
    if (blocks_.empty()) return;
    scanner_.fail_at(blocks_.back().begin, "this block is never closed; a '}' is missing");
  }

  void open_root() {
    if (!blocks_.empty()) fail("ROOT inside another joint; a '}' before it is missing");
    if (!result_.joints.empty()) {
      warnings_.add_once("roots", statement_,
                         "a further ROOT and all below it are ignored; only the first is read");
      if (result_.kept == 0) result_.kept = result_.joints.size();
    }
    open_joint(-1);
  }

  void open_joint(int parent) {
    const std::string_view name = scanner_.rest_of_line();
    if (name.empty()) fail("the joint has no name; write one after JOINT or ROOT");
    if (result_.joints.size() >= static_cast<std::size_t>(kMaxBvhJoints)) {
      fail("more than " + std::to_string(kMaxBvhJoints) + " joints, the most that are read");
    }
    DraftJoint joint;
    joint.name = name;
    joint.parent = parent;
    result_.joints.push_back(std::move(joint));
    if (parent >= 0) result_.joints[static_cast<std::size_t>(parent)].has_child = true;
    open_block({static_cast<int>(result_.joints.size()) - 1, false, statement_});
  }

  void open_end_site() {
    // Named or absent: `End Site`, `End Head`, `End` are all in use.
    static_cast<void>(scanner_.rest_of_line());
    open_block({blocks_.back().joint, true, statement_});
  }

  void open_block(const Block& block) {
    const std::string_view brace = scanner_.word();
    if (brace != "{") {
      scanner_.fail_at(scanner_.offset() - brace.size(), "expected '{', found " + quoted(brace));
    }
    if (blocks_.size() >= static_cast<std::size_t>(kMaxBvhDepth)) {
      fail("joints are nested more than " + std::to_string(kMaxBvhDepth) + " deep");
    }
    blocks_.push_back(block);
    end_site_offset_.reset();
  }

  void close_block() {
    DraftJoint& joint = joint_of_block();
    if (blocks_.back().is_end_site) {
      if (joint.end_site) {
        warnings_.add_once(
            "end sites", blocks_.back().begin,
            "joint " + quoted(joint.name) + " has several end sites; the first is read");
      } else {
        joint.end_site = end_site_offset_;
      }
    } else if (!joint.offset) {
      scanner_.fail_at(blocks_.back().begin, "joint " + quoted(joint.name) + " has no OFFSET");
    } else if (joint.has_child && joint.end_site) {
      warnings_.add_once("inner end site", blocks_.back().begin,
                         "joint " + quoted(joint.name) +
                             " has both a child joint and an end site; the end site is ignored");
      joint.end_site.reset();
    }
    blocks_.pop_back();
  }

  void read_offset() {
    const bool in_end_site = blocks_.back().is_end_site;
    std::optional<Eigen::Vector3d>& offset =
        in_end_site ? end_site_offset_ : joint_of_block().offset;
    if (offset) fail("a second OFFSET in one block");
    Eigen::Vector3d values;
    for (double& value : values) {
      scanner_.skip_space();
      value = scanner_.number();
    }
    offset = values;
  }

  void read_channels() {
    scanner_.skip_space();
    const double count = scanner_.number();
    if (!(count >= 0.0 && count <= 9.0) || count != std::floor(count)) {
      fail("CHANNELS must be a number from 0 to 9, then as many names");
    }
    std::vector<Channel> channels;
    for (int i = 0; i < static_cast<int>(count); ++i) channels.push_back(read_channel(channels));
    if (blocks_.back().is_end_site) {
      if (!channels.empty()) fail("an End Site cannot have channels; make it a JOINT");
      return;
    }
    if (joint_of_block().channels) fail("a second CHANNELS in one joint");
    joint_of_block().channels = std::move(channels);
  }

  [[nodiscard]] Channel read_channel(const std::vector<Channel>& before) {
    const std::string_view word = scanner_.word();
    const std::size_t begin = scanner_.offset() - word.size();
    const std::optional<Channel> channel = channel_of(word);
    if (!channel) {
      scanner_.fail_at(begin,
                       "expected a channel such as Zrotation or Xposition, found " + quoted(word));
    }
    if (std::find(before.begin(), before.end(), *channel) != before.end()) {
      scanner_.fail_at(begin, "channel " + quoted(word) + " is given twice");
    }
    if (channel->kind == ChannelKind::kScale) {
      warnings_.add_once("scale", begin, "scale channels are ignored");
    }
    return *channel;
  }

  TextScanner& scanner_;
  Warnings& warnings_;
  Hierarchy result_;
  std::vector<Block> blocks_;
  std::optional<Eigen::Vector3d> end_site_offset_;  // of the open End Site
  std::size_t statement_ = 0;                       // where the current statement begins
};

/// One unit of the last decimal of a number as it is written: 1e-4 of ".0083", 1e-8 of "8.333e-05".
double last_decimal(std::string_view text) {
  const std::size_t exponent_at = std::min(text.find_first_of("eE"), text.size());
  const std::string_view mantissa = text.substr(0, exponent_at);
  const std::size_t point = mantissa.find('.');
  const double decimals =
      point == mantissa.npos ? 0.0 : static_cast<double>(mantissa.size() - point - 1);
  // "1e-3" is as exact as it looks, so is "1": a whole mantissa has no decimals to be rounded in.
  if (decimals == 0.0) return 0.0;
  double exponent = 0.0;
  if (exponent_at < text.size()) {
    TextScanner scanner(text.substr(exponent_at + 1), "");
    exponent = scanner.number();
  }
  return std::pow(10.0, exponent - decimals);
}

/// 1 / Frame Time, snapped as read_bvh says.
double rate_of(double frame_time_s, double last_decimal_s) {
  const double rate = 1.0 / frame_time_s;
  const std::optional<double> whole = whole_rate_near(rate);
  // 1e-12 s: where Frame Time is written to the last bit, 1 / (1 / 120.0) need not be 120.
  return whole && std::abs(1.0 / *whole - frame_time_s) <= last_decimal_s + 1e-12 ? *whole : rate;
}

double read_frame_time(TextScanner& scanner, std::optional<double> override_hz) {
  scanner.skip_space();
  const std::size_t begin = scanner.offset();
  if (!scanner.accept_label("frame time")) {
    if (override_hz) return *override_hz;
    scanner.fail_at(begin,
                    "expected 'Frame Time:' and the seconds between two frames; give the "
                    "frame rate (--fps) if the file has none");
  }
  scanner.skip_blanks();
  const std::size_t number_begin = scanner.offset();
  if (override_hz) {
    static_cast<void>(scanner.rest_of_line());
    return *override_hz;
  }
  const double frame_time_s = scanner.number();
  if (!(frame_time_s > 0.0) || !std::isfinite(1.0 / frame_time_s)) {
    scanner.fail_at(number_begin,
                    "Frame Time must be greater than 0; give the frame rate (--fps) instead");
  }
  return rate_of(frame_time_s, last_decimal(scanner.text_between(number_begin, scanner.offset())));
}

/// Where the values of a row go, joint by joint.
struct RowLayout {
  /// A channel that sets a coordinate of a joint's position.
  struct Position {
    std::size_t column = 0;
    int axis = 0;
  };
  /// A joint's three axes in the order of its rotation channels; those it has no channel for last.
  struct Rotation {
    std::array<std::size_t, 3> columns = {};  // column_count: no channel, the angle is 0
    std::array<int, 3> axes = {0, 1, 2};
    double sign = 1.0;  // +1 if the axes are a cyclic shift of (x, y, z), else -1
  };

  std::vector<Rotation> rotations;               // of each kept joint
  std::vector<std::vector<Position>> positions;  // of each kept joint
  std::vector<std::size_t> movable;              // joints but the root that have position channels
  std::vector<Eigen::Vector3d> offsets_m;        // of each kept joint
};

RowLayout::Rotation rotation_layout(const DraftJoint& joint, std::size_t no_column) {
  RowLayout::Rotation rotation;
  std::array<bool, 3> used = {};
  std::size_t count = 0;
  const auto add = [&](int axis, std::size_t column) {
    rotation.axes[count] = axis;
    rotation.columns[count] = column;
    used[static_cast<std::size_t>(axis)] = true;
    ++count;
  };
  for (std::size_t c = 0; joint.channels && c < joint.channels->size(); ++c) {
    const Channel& channel = (*joint.channels)[c];
    if (channel.kind == ChannelKind::kRotation) add(channel.axis, joint.first_column + c);
  }
  for (int axis = 0; axis < 3; ++axis) {
    if (!used[static_cast<std::size_t>(axis)]) add(axis, no_column);
  }
  rotation.sign = (rotation.axes[0] + 1) % 3 == rotation.axes[1] ? 1.0 : -1.0;
  return rotation;
}

RowLayout make_layout(const Hierarchy& hierarchy, double unit_m) {
  RowLayout layout;
  layout.positions.resize(hierarchy.kept);
  for (std::size_t j = 0; j < hierarchy.kept; ++j) {
    const DraftJoint& joint = hierarchy.joints[j];
    layout.offsets_m.emplace_back(unit_m * *joint.offset);
    layout.rotations.push_back(rotation_layout(joint, hierarchy.column_count));
    for (std::size_t c = 0; joint.channels && c < joint.channels->size(); ++c) {
      const Channel& channel = (*joint.channels)[c];
      if (channel.kind != ChannelKind::kPosition) continue;
      layout.positions[j].push_back({joint.first_column + c, channel.axis});
    }
    if (j > 0 && !layout.positions[j].empty()) layout.movable.push_back(j);
  }
  return layout;
}

/// Turns rows of values into a clip's rotations and positions as they are read, so that the values
/// of a whole file are never held.
class MotionBuilder {
 public:
  /// @param with_translations  keeps the positions of all joints; without it take_row() returns
  ///                           false as soon as a joint but the root leaves its OFFSET.
  MotionBuilder(const RowLayout& layout, std::size_t column_count, double unit_m,
                bool with_translations)
      : layout_(layout),
        joints_(layout.rotations.size()),
        unit_m_(unit_m),
        with_translations_(with_translations),
        row_(column_count + 1, 0.0),
        moves_(joints_, false),
        angles_(3 * joints_),
        sines_(3 * joints_),
        cosines_(3 * joints_) {}

  /// The values of the next row; its last element, beyond the columns, is 0 and stays so.
  [[nodiscard]] std::vector<double>& row() noexcept { return row_; }
  [[nodiscard]] std::size_t row_count() const noexcept { return row_count_; }

  /// Bytes that so many rows take.
  [[nodiscard]] double bytes_of(std::size_t rows) const {
    const double cell = sizeof(Eigen::Quaterniond) + (with_translations_ ? kPositionSize : 0.0);
    return static_cast<double>(rows) * (static_cast<double>(joints_) * cell + kPositionSize);
  }
  [[nodiscard]] std::size_t capacity() const noexcept { return capacity_; }
  void reserve(std::size_t rows) {
    capacity_ = rows;
    const auto columns = static_cast<Eigen::Index>(rows);
    motion_.rotations.reserve(rows * joints_);
    base::prefer_huge_pages(motion_.rotations.data(), rows * joints_ * sizeof(Eigen::Quaterniond));
    motion_.root_positions.conservativeResize(3, columns);
    if (with_translations_) {
      motion_.translations.conservativeResize(3, columns * static_cast<Eigen::Index>(joints_));
    }
  }

  /// Takes row() as the next row, for which there is room. False: a joint leaves its OFFSET, and
  /// this builder does not keep it.
  [[nodiscard]] bool take_row() {
    add_rotations();
    if (!add_positions()) return false;
    ++row_count_;
    return true;
  }

  [[nodiscard]] Motion finish() {
    reserve(row_count_);
    for (std::size_t j = 0; with_translations_ && j < joints_; ++j) {
      if (j > 0 && !moves_[j]) hold_still(j);
    }
    return std::move(motion_);
  }

 private:
  static constexpr double kPositionSize = 3 * sizeof(double);

  void add_rotations() {
    for (std::size_t j = 0; j < joints_; ++j) {
      for (std::size_t n = 0; n < 3; ++n) {
        const double degrees = row_[layout_.rotations[j].columns[n]];
        // Two whole turns are the period of a half-angle's sine; remainder is exact.
        angles_[3 * j + n] =
            std::abs(degrees) <= kLargestDegrees ? degrees : std::remainder(degrees, 720.0);
      }
    }
    half_angle_sin_cos(angles_, sines_, cosines_);
    const std::size_t first = motion_.rotations.size();
    motion_.rotations.resize(first + joints_);
    for (std::size_t j = 0; j < joints_; ++j) {
      compose(layout_.rotations[j], &sines_[3 * j], &cosines_[3 * j],
              motion_.rotations[first + j].coeffs());
    }
  }

  // (c0 + s0 e0) (c1 + s1 e1) (c2 + s2 e2), where e0 e1 = sign e2 and so on.
  static void compose(const RowLayout::Rotation& rotation, const double* s, const double* c,
                      Eigen::Vector4d& xyzw) {
    const double cc = c[0] * c[1];
    const double ss = rotation.sign * (s[0] * s[1]);
    const double sc = s[0] * c[1];
    const double cs = c[0] * s[1];
    xyzw[rotation.axes[0]] = sc * c[2] + rotation.sign * (cs * s[2]);
    xyzw[rotation.axes[1]] = cs * c[2] - rotation.sign * (sc * s[2]);
    xyzw[rotation.axes[2]] = cc * s[2] + ss * c[2];
    xyzw[3] = cc * c[2] - ss * s[2];
  }

  [[nodiscard]] Eigen::Vector3d position(std::size_t joint) const {
    Eigen::Vector3d result = layout_.offsets_m[joint];
    for (const RowLayout::Position& channel : layout_.positions[joint]) {
      result[channel.axis] = unit_m_ * row_[channel.column];
    }
    return result;
  }

  [[nodiscard]] bool add_positions() {
    const auto row = static_cast<Eigen::Index>(row_count_);
    const Eigen::Index cell = row * static_cast<Eigen::Index>(joints_);
    const Eigen::Vector3d root = position(0);
    motion_.root_positions.col(row) = root;
    if (with_translations_) {
      for (std::size_t j = 0; j < joints_; ++j) {
        motion_.translations.col(cell + static_cast<Eigen::Index>(j)) = layout_.offsets_m[j];
      }
      motion_.translations.col(cell) = root;
    }
    for (const std::size_t j : layout_.movable) {
      const Eigen::Vector3d now = position(j);
      if ((now - layout_.offsets_m[j]).norm() > kStillOffsetM) {
        if (!with_translations_) return false;
        moves_[j] = true;
      }
      if (with_translations_) motion_.translations.col(cell + static_cast<Eigen::Index>(j)) = now;
    }
    return true;
  }

  /// Puts a joint that never leaves its OFFSET exactly onto it.
  void hold_still(std::size_t joint) {
    const auto stride = static_cast<Eigen::Index>(joints_);
    for (auto cell = static_cast<Eigen::Index>(joint); cell < motion_.translations.cols();
         cell += stride) {
      motion_.translations.col(cell) = layout_.offsets_m[joint];
    }
  }

  const RowLayout& layout_;
  std::size_t joints_;
  double unit_m_;
  bool with_translations_;
  std::vector<double> row_;
  std::vector<bool> moves_;  // joints that ever leave their OFFSET
  std::vector<double> angles_;
  std::vector<double> sines_;
  std::vector<double> cosines_;
  std::size_t row_count_ = 0;
  std::size_t capacity_ = 0;
  Motion motion_;
};

/// Reads rows of values up to the end. A row begins and ends with a line; it may take several lines
/// only if the first row does, else a short row would swallow the next.
class RowReader {
 public:
  /// @param file_size  bytes of the whole file.
  RowReader(TextScanner& scanner, std::size_t column_count, std::size_t file_size,
            MotionBuilder& builder)
      : scanner_(scanner),
        column_count_(column_count),
        file_size_(file_size),
        rows_begin_(scanner.offset()),
        builder_(builder) {}

  /// False if the builder has given up.
  /// @param claimed_rows  what the file says; it is a claim.
  [[nodiscard]] bool read(double claimed_rows) {
    // A value takes at least two bytes, so no more than that is set aside for it.
    const std::size_t possible = (file_size_ - rows_begin_) / (2 * column_count_) + 1;
    const double rows = std::clamp(claimed_rows, 1.0, static_cast<double>(possible));
    if (is_affordable(builder_.bytes_of(static_cast<std::size_t>(rows)))) {
      builder_.reserve(static_cast<std::size_t>(rows));
    }
    std::vector<double>& row = builder_.row();
    for (;;) {
      scanner_.skip_blanks();
      const char next = scanner_.peek();
      if (next == '\n' || next == '\r' || scanner_.at_end()) {
        if (!end_line()) return false;
        if (scanner_.at_end()) break;
        scanner_.skip();
      } else {
        if (in_row_ == column_count_) first_extra_ = scanner_.offset();
        const double value = scanner_.number();
        if (in_row_ < column_count_) row[in_row_] = value;
        ++in_row_;
        value_end_ = scanner_.offset();
      }
    }
    if (in_row_ != 0) fail_short(in_row_, value_end_);
    return true;
  }

 private:
  /// False if the builder has given up.
  [[nodiscard]] bool end_line() {
    if (in_row_ == line_begin_) return true;  // a blank line
    if (line_begin_ == 0) {
      first_line_count_ = in_row_;
      first_line_end_ = value_end_;
    }
    line_begin_ = in_row_;
    if (in_row_ == column_count_) return end_row();
    if (in_row_ > column_count_) {
      if (first_line_count_ < column_count_) fail_short(first_line_count_, first_line_end_);
      scanner_.fail_at(first_extra_, expected() + std::to_string(in_row_));
    }
    if (builder_.row_count() > 0 && !wrapped_) fail_short(in_row_, value_end_);
    return true;
  }

  [[nodiscard]] bool end_row() {
    if (builder_.row_count() == 0) wrapped_ = first_line_count_ != column_count_;
    if (builder_.row_count() == builder_.capacity()) make_room();
    in_row_ = 0;
    line_begin_ = 0;
    return builder_.take_row();
  }

  [[nodiscard]] bool is_affordable(double bytes) const {
    return bytes <= kMemoryPerByte * static_cast<double>(file_size_) + kFreeMemory;
  }

  /// More rows than Frames says: room for as many as there will be if they go on being as long.
  void make_room() {
    const std::size_t rows = builder_.row_count();
    const auto read = static_cast<double>(scanner_.offset() - rows_begin_);
    const auto all = static_cast<double>(file_size_ - rows_begin_);
    const double expected_rows = 1.02 * static_cast<double>(rows + 1) * all / read;
    std::size_t capacity = std::max(rows + 1, static_cast<std::size_t>(expected_rows));
    // Both are held while one is copied to the other.
    const double held = builder_.bytes_of(rows);
    if (!is_affordable(held + builder_.bytes_of(capacity))) capacity = rows + rows / 8 + 1;
    if (capacity > kMostRows || !is_affordable(held + builder_.bytes_of(capacity))) fail_large();
    builder_.reserve(capacity);
  }

  /// Joints without channels cost a row nothing in the file but a rotation each in memory.
  [[noreturn]] void fail_large() const {
    scanner_.fail_at(scanner_.offset(),
                     "the motion takes more memory than is read from a file of this size; remove "
                     "the joints without channels");
  }

  [[nodiscard]] std::string expected() const {
    return "expected " + std::to_string(column_count_) + " channel values, found ";
  }
  [[noreturn]] void fail_short(std::size_t found, std::size_t offset) const {
    scanner_.fail_at(offset, expected() + std::to_string(found));
  }

  TextScanner& scanner_;
  std::size_t column_count_;
  std::size_t file_size_;
  std::size_t rows_begin_;
  MotionBuilder& builder_;
  std::size_t in_row_ = 0;            // values of the current row so far
  std::size_t line_begin_ = 0;        // of them, before the current line
  std::size_t first_line_count_ = 0;  // values in the first line of the current row
  std::size_t first_line_end_ = 0;    // where it ends
  std::size_t value_end_ = 0;         // where the last value ends
  std::size_t first_extra_ = 0;       // where the first value too many of a row begins
  bool wrapped_ = false;
};

/// What stands between MOTION and the rows.
struct MotionHead {
  std::size_t begin = 0;  // of Frames
  double frames = 0.0;
  std::string frames_text;
  double frame_rate_hz = 0.0;
};

MotionHead read_motion_head(TextScanner& scanner, std::optional<double> override_hz) {
  MotionHead head;
  scanner.skip_space();
  head.begin = scanner.offset();
  if (!scanner.accept_label("frames")) {
    scanner.fail_at(head.begin, "expected 'Frames:' and the number of frames after MOTION");
  }
  scanner.skip_blanks();
  const std::size_t number_begin = scanner.offset();
  head.frames = scanner.number();
  // Fewer than it says may be a file cut short; this is no count at all.
  if (head.frames > static_cast<double>(kMostRows)) {
    scanner.fail_at(number_begin, "Frames must be at most " + std::to_string(kMostRows) +
                                      "; give the number of rows");
  }
  head.frames_text = scanner.text_between(number_begin, scanner.offset());
  head.frame_rate_hz = read_frame_time(scanner, override_hz);
  return head;
}

/// The values of the first row; none if it is not whole, which the rows' reader will tell.
std::vector<double> peek_first_row(TextScanner scanner, std::size_t column_count) {
  std::vector<double> row;
  try {
    while (row.size() < column_count) {
      scanner.skip_space();
      row.push_back(scanner.number());
    }
  } catch (const base::Error&) {
    row.clear();
  }
  return row;
}

bool is_carried_by_positions(const DraftJoint& joint) {
  if (joint.parent < 0 || !joint.channels || !joint.offset->isZero(0.0)) return false;
  return std::count_if(joint.channels->begin(), joint.channels->end(), [](const Channel& channel) {
           return channel.kind == ChannelKind::kPosition;
         }) == 3;
}

/// A joint with OFFSET 0 0 0 and position channels, as write_bvh and others write what moves within
/// its parent, lies at rest where the first row has it: its skeleton would have no bone there.
void take_offsets_from_first_row(const TextScanner& at_rows, Hierarchy& hierarchy) {
  if (std::none_of(hierarchy.joints.begin(), hierarchy.joints.end(), is_carried_by_positions)) {
    return;
  }
  const std::vector<double> row = peek_first_row(at_rows, hierarchy.column_count);
  if (row.empty()) return;
  for (DraftJoint& joint : hierarchy.joints) {
    if (!is_carried_by_positions(joint)) continue;
    for (std::size_t c = 0; c < joint.channels->size(); ++c) {
      const Channel& channel = (*joint.channels)[c];
      if (channel.kind == ChannelKind::kPosition) {
        (*joint.offset)[channel.axis] = row[joint.first_column + c];
      }
    }
  }
}

Motion read_motion(TextScanner& scanner, const MotionHead& head, std::size_t file_size,
                   const Hierarchy& hierarchy, double unit_m, Warnings& warnings) {
  const std::size_t rows_begin = scanner.offset();
  const RowLayout layout = make_layout(hierarchy, unit_m);
  // Most joints with position channels repeat their OFFSET. Positions are kept only if one does
  // not, which most often shows in the first row, and then the rows are read again.
  for (const bool with_translations : {false, true}) {
    scanner.seek(rows_begin);
    MotionBuilder builder(layout, hierarchy.column_count, unit_m, with_translations);
    if (!RowReader(scanner, hierarchy.column_count, file_size, builder).read(head.frames)) continue;
    const std::size_t rows = builder.row_count();
    if (rows == 0) scanner.fail_at(head.begin, "there is no row of values, so no motion");
    if (head.frames != static_cast<double>(rows)) {
      warnings.add_once("frames", head.begin,
                        "Frames says " + head.frames_text + ", but there are " +
                            std::to_string(rows) + " rows of values; these are read");
    }
    Motion motion = builder.finish();
    motion.frame_rate_hz = head.frame_rate_hz;
    return motion;
  }
  LABAN_CHECK(false);
  return {};
}

/// Joints as the file has them, in its own unit.
std::vector<motion::Joint> make_joints(const Hierarchy& hierarchy) {
  std::vector<motion::Joint> joints(hierarchy.kept);
  for (std::size_t i = 0; i < hierarchy.kept; ++i) {
    const DraftJoint& draft = hierarchy.joints[i];
    joints[i].name = std::string(draft.name);
    joints[i].parent = draft.parent;
    joints[i].rest_offset = *draft.offset;
    joints[i].end_site = draft.end_site;
  }
  return joints;
}

std::shared_ptr<const motion::Skeleton> make_skeleton(std::vector<motion::Joint> joints,
                                                      double unit_m) {
  for (motion::Joint& joint : joints) {
    joint.rest_offset *= unit_m;
    if (joint.end_site) *joint.end_site *= unit_m;
  }
  return std::make_shared<const motion::Skeleton>(std::move(joints));
}

}  // namespace

std::vector<std::string> BvhReadOptions::problems() const {
  std::vector<std::string> found;
  const auto require_positive = [&](const std::optional<double>& value, const char* name) {
    if (!value || (*value > 0.0 && *value <= 1e6)) return;
    found.push_back("BvhReadOptions::" + std::string(name) + " = " + std::to_string(*value) +
                    " (must be > 0 and at most 1e6)");
  };
  require_positive(unit_m, "unit_m");
  require_positive(frame_rate_hz, "frame_rate_hz");
  return found;
}

BvhFile read_bvh(std::string_view text, std::string_view name, const BvhReadOptions& options) {
  const std::vector<std::string> problems = options.problems();
  if (!problems.empty()) throw base::Error(base::ErrorKind::kUsage, problems.front());
  TextScanner scanner(text, name);
  Warnings warnings(scanner);
  Hierarchy hierarchy = HierarchyReader(scanner, warnings).read();
  const MotionHead head = read_motion_head(scanner, options.frame_rate_hz);
  take_offsets_from_first_row(scanner, hierarchy);
  std::vector<motion::Joint> joints = make_joints(hierarchy);
  const double unit_m = options.unit_m ? *options.unit_m : guess_unit_m(joints, warnings);
  Motion motion = read_motion(scanner, head, text.size(), hierarchy, unit_m, warnings);
  return {motion::Clip(make_skeleton(std::move(joints), unit_m), motion.frame_rate_hz,
                       std::move(motion.root_positions), std::move(motion.rotations),
                       std::move(motion.translations)),
          unit_m, !options.unit_m.has_value(), warnings.take()};
}

}  // namespace laban::io
