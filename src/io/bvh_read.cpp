#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <numbers>

#include "laban/base/error.h"
#include "laban/io/bvh.h"

#include "io/text_scanner.h"

namespace laban::io {
namespace {

constexpr double kHalfDegree = std::numbers::pi / 360.0;

// A joint whose positions never leave its OFFSET by more than this does not animate position:
// exporters that write six channels everywhere repeat the OFFSET with float32 noise.
constexpr double kStillM = 1e-6;

// Reach of an adult from the hips to the fingertips by way of the chest, metres. Right for every
// file at hand: a reach of 0.70 to 1.78 m is read in the right one of centimetre and inch, the
// closest pair of units.
constexpr double kReachM = 1.12;
constexpr std::array<double, 5> kUnitsM = {1.0, 0.01, 0.001, 0.0254, 0.05644};

// Rates that cameras, games and capture systems run at.
constexpr std::array<double, 12> kCustomaryRatesHz = {24, 25,  30,  50,  60,  72,
                                                      90, 100, 120, 144, 200, 240};

// Rotations that any file may ask for, however small it is; see check_size.
constexpr std::size_t kFreeRotations = std::size_t{1} << 22U;

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
  std::size_t row_count = 0;
  std::vector<double> values;  // row_count * column_count
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

/// Warnings in the order of the file; each kind is said once, or a file of them would drown the
/// rest.
class Warnings {
 public:
  explicit Warnings(const TextScanner& scanner) : scanner_(scanner) {}

  void add_once(std::string_view kind, std::size_t offset, const std::string& message) {
    if (std::find(kinds_.begin(), kinds_.end(), kind) != kinds_.end()) return;
    kinds_.push_back(kind);
    messages_.push_back(scanner_.message_at(offset, message));
  }
  [[nodiscard]] std::vector<std::string> take() { return std::move(messages_); }

 private:
  const TextScanner& scanner_;
  std::vector<std::string_view> kinds_;
  std::vector<std::string> messages_;
};

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
  const double whole = std::round(rate);
  const bool customary = std::find(kCustomaryRatesHz.begin(), kCustomaryRatesHz.end(), whole) !=
                         kCustomaryRatesHz.end();
  const bool near_rate = std::abs(rate - whole) <= (customary ? 0.005 : 0.0001) * whole;
  // 1e-12 s: where Frame Time is written to the last bit, 1 / (1 / 120.0) need not be 120.
  const bool near_time = std::abs(1.0 / whole - frame_time_s) <= last_decimal_s + 1e-12;
  return whole >= 1.0 && near_rate && near_time ? whole : rate;
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

/// Reads rows of values up to the end. A row begins and ends with a line; it may take several lines
/// only if the first row does, else a short row would swallow the next.
class RowReader {
 public:
  RowReader(TextScanner& scanner, std::size_t column_count)
      : scanner_(scanner), column_count_(column_count) {}

  void read(Motion& motion) {
    std::vector<double>& values = motion.values;
    for (;;) {
      scanner_.skip_blanks();
      const char next = scanner_.peek();
      if (next == '\n' || next == '\r' || scanner_.at_end()) {
        end_line(values.size());
        if (scanner_.at_end()) break;
        scanner_.skip();
      } else {
        if (values.size() - row_begin_ == column_count_) first_extra_ = scanner_.offset();
        values.push_back(scanner_.number());
        value_end_ = scanner_.offset();
      }
    }
    if (values.size() != row_begin_) fail_short(values.size() - row_begin_, value_end_);
    motion.row_count = rows_;
  }

 private:
  void end_line(std::size_t value_count) {
    const std::size_t in_row = value_count - row_begin_;
    if (in_row == line_begin_ - row_begin_) return;  // a blank line
    if (line_begin_ == row_begin_) {
      first_line_count_ = in_row;
      first_line_end_ = value_end_;
    }
    line_begin_ = value_count;
    if (in_row == column_count_) {
      if (rows_ == 0) wrapped_ = first_line_count_ != column_count_;
      ++rows_;
      row_begin_ = value_count;
    } else if (in_row > column_count_ && first_line_count_ < column_count_) {
      fail_short(first_line_count_, first_line_end_);
    } else if (in_row > column_count_) {
      scanner_.fail_at(first_extra_, expected() + std::to_string(in_row));
    } else if (rows_ > 0 && !wrapped_) {
      fail_short(in_row, value_end_);
    }
  }

  [[nodiscard]] std::string expected() const {
    return "expected " + std::to_string(column_count_) + " channel values, found ";
  }
  [[noreturn]] void fail_short(std::size_t found, std::size_t offset) const {
    scanner_.fail_at(offset, expected() + std::to_string(found));
  }

  TextScanner& scanner_;
  std::size_t column_count_;
  std::size_t rows_ = 0;
  std::size_t row_begin_ = 0;         // values before the current row
  std::size_t line_begin_ = 0;        // values before the current line
  std::size_t first_line_count_ = 0;  // values in the first line of the current row
  std::size_t first_line_end_ = 0;    // where it ends
  std::size_t value_end_ = 0;         // where the last value ends
  std::size_t first_extra_ = 0;       // where the first value too many of a row begins
  bool wrapped_ = false;
};

Motion read_motion(TextScanner& scanner, std::string_view text, const Hierarchy& hierarchy,
                   std::optional<double> override_hz, Warnings& warnings) {
  scanner.skip_space();
  const std::size_t begin = scanner.offset();
  if (!scanner.accept_label("frames")) {
    scanner.fail_at(begin, "expected 'Frames:' and the number of frames after MOTION");
  }
  scanner.skip_blanks();
  const std::size_t number_begin = scanner.offset();
  const double frames = scanner.number();
  const std::string frames_text(scanner.text_between(number_begin, scanner.offset()));
  Motion motion;
  motion.frame_rate_hz = read_frame_time(scanner, override_hz);
  // Frames is a claim: a value takes at least two bytes, so no more than that is set aside for it.
  const double claimed = std::max(0.0, frames) * static_cast<double>(hierarchy.column_count);
  const std::size_t possible_count = (text.size() - scanner.offset()) / 2 + 1;
  const auto possible = static_cast<double>(possible_count);
  motion.values.reserve(static_cast<std::size_t>(std::min(claimed, possible)));
  RowReader(scanner, hierarchy.column_count).read(motion);
  if (motion.row_count == 0) scanner.fail_at(begin, "there is no row of values, so no motion");
  if (frames != static_cast<double>(motion.row_count)) {
    warnings.add_once("frames", begin,
                      "Frames says " + frames_text + ", but there are " +
                          std::to_string(motion.row_count) + " rows of values; these are read");
  }
  return motion;
}

/// Joints without channels cost a row nothing in the file but a rotation each in memory.
void check_size(const TextScanner& scanner, std::size_t rows, std::size_t joints,
                std::size_t bytes) {
  if (rows <= std::max(kFreeRotations, bytes) / joints) return;
  scanner.fail_at(0, std::to_string(rows) + " rows of " + std::to_string(joints) +
                         " joints, most without channels, are more than is read from a file of "
                         "this size; remove the joints without channels");
}

/// The longest sum of offset lengths from the first joint with two children or more (else the root)
/// down to a leaf, end sites included; file units.
double reach(const Hierarchy& hierarchy) {
  const std::size_t count = hierarchy.kept;
  std::vector<int> child_counts(count, 0);
  std::vector<double> below(count, 0.0);  // longest way from a joint down
  for (std::size_t i = count; i-- > 0;) {
    const DraftJoint& joint = hierarchy.joints[i];
    if (joint.end_site) below[i] = std::max(below[i], joint.end_site->norm());
    if (joint.parent < 0) continue;
    const auto parent = static_cast<std::size_t>(joint.parent);
    ++child_counts[parent];
    below[parent] = std::max(below[parent], joint.offset->norm() + below[i]);
  }
  const auto branching =
      std::find_if(child_counts.begin(), child_counts.end(), [](int n) { return n >= 2; });
  return below[branching == child_counts.end()
                   ? 0
                   : static_cast<std::size_t>(branching - child_counts.begin())];
}

double guess_unit_m(const Hierarchy& hierarchy, Warnings& warnings) {
  const double units = reach(hierarchy);
  if (!(units > 1e-9)) {
    warnings.add_once("unit", 0,
                      "the skeleton has no size to guess its unit from; centimetres are "
                      "taken (--unit says otherwise)");
    return 0.01;
  }
  const auto error = [&](double unit_m) { return std::abs(std::log(units * unit_m / kReachM)); };
  return *std::min_element(kUnitsM.begin(), kUnitsM.end(),
                           [&](double a, double b) { return error(a) < error(b); });
}

std::shared_ptr<const motion::Skeleton> make_skeleton(const Hierarchy& hierarchy, double unit_m) {
  std::vector<motion::Joint> joints(hierarchy.kept);
  for (std::size_t i = 0; i < hierarchy.kept; ++i) {
    const DraftJoint& draft = hierarchy.joints[i];
    joints[i].name = std::string(draft.name);
    joints[i].parent = draft.parent;
    joints[i].rest_offset = unit_m * *draft.offset;
    if (draft.end_site) joints[i].end_site = unit_m * *draft.end_site;
  }
  return std::make_shared<const motion::Skeleton>(std::move(joints));
}

/// q * (rotation by `degrees` about an axis).
void rotate(Eigen::Quaterniond& q, int axis, double degrees) {
  const double c = std::cos(kHalfDegree * degrees);
  const double s = std::sin(kHalfDegree * degrees);
  const Eigen::Index a = axis;
  const Eigen::Index b = (axis + 1) % 3;
  const Eigen::Index d = (axis + 2) % 3;
  const Eigen::Vector4d v = q.coeffs();  // x, y, z, w
  q.coeffs()[a] = v[a] * c + v[3] * s;
  q.coeffs()[b] = v[b] * c + v[d] * s;
  q.coeffs()[d] = v[d] * c - v[b] * s;
  q.coeffs()[3] = v[3] * c - v[a] * s;
}

std::vector<Eigen::Quaterniond> make_rotations(const Hierarchy& hierarchy, const Motion& motion) {
  std::vector<Eigen::Quaterniond> rotations(motion.row_count * hierarchy.kept,
                                            Eigen::Quaterniond::Identity());
  std::size_t cell = 0;
  for (std::size_t row = 0; row < motion.row_count; ++row) {
    const double* const values = motion.values.data() + row * hierarchy.column_count;
    for (std::size_t j = 0; j < hierarchy.kept; ++j, ++cell) {
      const DraftJoint& joint = hierarchy.joints[j];
      if (!joint.channels) continue;
      const double* value = values + joint.first_column;
      for (const Channel& channel : *joint.channels) {
        if (channel.kind == ChannelKind::kRotation) rotate(rotations[cell], channel.axis, *value);
        ++value;
      }
    }
  }
  return rotations;
}

bool animates_position(const DraftJoint& joint) {
  return joint.channels &&
         std::any_of(joint.channels->begin(), joint.channels->end(),
                     [](const Channel& channel) { return channel.kind == ChannelKind::kPosition; });
}

/// 3 x rows, metres: a joint's position channels, and its OFFSET on axes that have none.
Eigen::Matrix3Xd positions_of(const Hierarchy& hierarchy, const Motion& motion, std::size_t index,
                              double unit_m) {
  const DraftJoint& joint = hierarchy.joints[index];
  Eigen::Matrix3Xd positions =
      (unit_m * *joint.offset).replicate(1, static_cast<Eigen::Index>(motion.row_count));
  if (!joint.channels) return positions;
  for (std::size_t c = 0; c < joint.channels->size(); ++c) {
    const Channel& channel = (*joint.channels)[c];
    if (channel.kind != ChannelKind::kPosition) continue;
    const double* value = motion.values.data() + joint.first_column + c;
    for (Eigen::Index row = 0; row < positions.cols(); ++row) {
      positions(channel.axis, row) =
          unit_m * value[static_cast<std::size_t>(row) * hierarchy.column_count];
    }
  }
  return positions;
}

/// 3 x rows * joints of joints that leave their OFFSET, or empty if only the root does.
Eigen::Matrix3Xd make_translations(const Hierarchy& hierarchy, const Motion& motion, double unit_m,
                                   const Eigen::Matrix3Xd& root_positions) {
  const auto joints = static_cast<Eigen::Index>(hierarchy.kept);
  const auto rows = static_cast<Eigen::Index>(motion.row_count);
  Eigen::Matrix3Xd translations;
  for (Eigen::Index j = 1; j < joints; ++j) {
    const DraftJoint& joint = hierarchy.joints[static_cast<std::size_t>(j)];
    if (!animates_position(joint)) continue;
    const Eigen::Vector3d offset = unit_m * *joint.offset;
    const Eigen::Matrix3Xd positions =
        positions_of(hierarchy, motion, static_cast<std::size_t>(j), unit_m);
    if ((positions.colwise() - offset).colwise().norm().maxCoeff() <= kStillM) continue;
    if (translations.cols() == 0) {
      Eigen::Matrix3Xd rest(3, joints);
      for (Eigen::Index i = 0; i < joints; ++i) {
        rest.col(i) = unit_m * *hierarchy.joints[static_cast<std::size_t>(i)].offset;
      }
      translations = rest.replicate(1, rows);
      for (Eigen::Index row = 0; row < rows; ++row) {
        translations.col(row * joints) = root_positions.col(row);
      }
    }
    for (Eigen::Index row = 0; row < rows; ++row) {
      translations.col(row * joints + j) = positions.col(row);
    }
  }
  return translations;
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
  const Hierarchy hierarchy = HierarchyReader(scanner, warnings).read();
  const Motion motion = read_motion(scanner, text, hierarchy, options.frame_rate_hz, warnings);
  check_size(scanner, motion.row_count, hierarchy.kept, text.size());
  const double unit_m = options.unit_m ? *options.unit_m : guess_unit_m(hierarchy, warnings);
  std::shared_ptr<const motion::Skeleton> skeleton = make_skeleton(hierarchy, unit_m);
  Eigen::Matrix3Xd root_positions = positions_of(hierarchy, motion, 0, unit_m);
  Eigen::Matrix3Xd translations = make_translations(hierarchy, motion, unit_m, root_positions);
  return {motion::Clip(std::move(skeleton), motion.frame_rate_hz, std::move(root_positions),
                       make_rotations(hierarchy, motion), std::move(translations)),
          unit_m, !options.unit_m.has_value(), warnings.take()};
}

}  // namespace laban::io
