#include <algorithm>
#include <array>
#include <cmath>
#include <map>

#include "laban/base/error.h"
#include "laban/io/asf_amc.h"
#include "laban/math/constants.h"
#include "laban/math/rotation.h"

#include "io/text_scanner.h"
#include "io/unit_guess.h"
#include "io/warnings.h"

namespace laban::io {
namespace {

using Eigen::Quaterniond;
using Eigen::Vector3d;

constexpr double kInchM = 0.0254;
constexpr int kNoParent = -1;
constexpr int kRoot = 0;

/// A bone as the file has it; the first is the root.
struct DraftBone {
  std::string_view name;
  std::size_t begin = 0;  // of its block
  Vector3d direction = Vector3d::Zero();
  double length = 0.0;
  Vector3d angles = Vector3d::Zero();  // in the file's unit of angle
  std::string axis_order = "XYZ";
  std::vector<AsfDof> dofs;
  int parent = kNoParent;
  std::vector<int> children;  // in the order of the hierarchy
};

struct Draft {
  std::vector<DraftBone> bones;
  Vector3d root_position = Vector3d::Zero();
  bool degrees = true;
  std::optional<double> length_scale;  // :units length
};

bool is_ascii(std::string_view text) {
  return std::all_of(text.begin(), text.end(), [](char c) { return c > ' ' && c < '\x7F'; });
}

std::optional<AsfDof> dof_of(std::string_view word) {
  constexpr std::array<std::string_view, 7> kWords = {"tx", "ty", "tz", "rx", "ry", "rz", "l"};
  for (std::size_t i = 0; i < kWords.size(); ++i) {
    if (equal_but_for_case(word, kWords[i])) return static_cast<AsfDof>(i);
  }
  return std::nullopt;
}

/// Reads the sections of an ASF file, line by line.
class SectionReader {
 public:
  SectionReader(TextScanner& scanner, Warnings& warnings) : scanner_(scanner), warnings_(warnings) {
    draft_.bones.emplace_back();
    draft_.bones.front().name = "root";
    index_.emplace("root", kRoot);
  }

  [[nodiscard]] Draft read() {
    bool more = next_line();
    while (more) {
      const std::string_view section = scanner_.word();
      if (!section.starts_with(':')) {
        fail("expected a section such as :units or :bonedata, found " + quoted(section));
      }
      more = read_section(section);
    }
    if (draft_.bones.size() == 1) {
      fail("there are no bones; a skeleton has :bonedata and :hierarchy");
    }
    require_all_connected();
    return std::move(draft_);
  }

 private:
  [[noreturn]] void fail(const std::string& message) const { scanner_.fail_at(line_, message); }

  /// Goes to the next line that says something; false at the end.
  [[nodiscard]] bool next_line() {
    scanner_.skip_space();
    while (scanner_.peek() == '#') {
      skip_line();
      scanner_.skip_space();
    }
    line_ = scanner_.offset();
    return !scanner_.at_end();
  }
  /// As next_line, but false at the next section too.
  [[nodiscard]] bool next_line_of_section() {
    skip_line();
    return next_line() && scanner_.peek() != ':';
  }
  void skip_line() {
    while (!scanner_.at_end() && !at_line_end()) scanner_.skip();
  }
  [[nodiscard]] bool at_line_end() const {
    const char next = scanner_.peek();
    return scanner_.at_end() || next == '\n' || next == '\r';
  }
  /// The next word of the line; empty at its end or at a comment.
  [[nodiscard]] std::string_view word_of_line() {
    scanner_.skip_blanks();
    return at_line_end() || scanner_.peek() == '#' ? std::string_view() : scanner_.word();
  }
  [[nodiscard]] double number() {
    scanner_.skip_blanks();
    if (at_line_end()) scanner_.fail_at(scanner_.offset(), "the line ends where a number is due");
    return scanner_.number();
  }
  [[nodiscard]] Vector3d three_numbers() {
    Vector3d values;
    for (double& value : values) value = number();
    return values;
  }

  /// Reads to the beginning of the next section; false at the end.
  [[nodiscard]] bool read_section(std::string_view section) {
    if (equal_but_for_case(section, ":units")) {
      while (next_line_of_section()) read_unit();
    } else if (equal_but_for_case(section, ":root")) {
      while (next_line_of_section()) read_root_line();
    } else if (equal_but_for_case(section, ":bonedata")) {
      read_bones();
    } else if (equal_but_for_case(section, ":hierarchy")) {
      while (next_line_of_section()) read_family();
    } else {
      const bool known = equal_but_for_case(section, ":version") ||
                         equal_but_for_case(section, ":name") ||
                         equal_but_for_case(section, ":namespace") ||
                         equal_but_for_case(section, ":documentation");
      if (!known) {
        warnings_.add_once("section", line_, "section " + quoted(section) + " is ignored");
      }
      while (next_line_of_section()) {
      }
    }
    return !scanner_.at_end();
  }

  void read_unit() {
    const std::string_view what = scanner_.word();
    if (equal_but_for_case(what, "length")) {
      const double scale = number();
      if (!(scale > 0.0)) fail("the length of :units must be greater than 0");
      draft_.length_scale = scale;
    } else if (equal_but_for_case(what, "angle")) {
      const std::string_view unit = word_of_line();
      if (!equal_but_for_case(unit, "deg") && !equal_but_for_case(unit, "rad")) {
        fail("the angle of :units must be deg or rad, found " + quoted(unit));
      }
      draft_.degrees = equal_but_for_case(unit, "deg");
    } else if (!equal_but_for_case(what, "mass")) {
      warnings_.add_once("unit line", line_, "unit " + quoted(what) + " is ignored");
    }
  }

  void read_root_line() {
    const std::string_view what = scanner_.word();
    DraftBone& root = draft_.bones.front();
    if (equal_but_for_case(what, "order")) {
      root.dofs = read_dofs();
    } else if (equal_but_for_case(what, "axis")) {
      root.axis_order = read_axis_order();
    } else if (equal_but_for_case(what, "position")) {
      draft_.root_position = three_numbers();
    } else if (equal_but_for_case(what, "orientation")) {
      root.angles = three_numbers();
    } else {
      warnings_.add_once("root line", line_, quoted(what) + " in :root is ignored");
    }
  }

  [[nodiscard]] std::vector<AsfDof> read_dofs() {
    std::vector<AsfDof> dofs;
    for (std::string_view word = word_of_line(); !word.empty(); word = word_of_line()) {
      const std::size_t begin = scanner_.offset() - word.size();
      const std::optional<AsfDof> dof = dof_of(word);
      if (!dof)
        scanner_.fail_at(begin, "expected tx, ty, tz, rx, ry, rz or l, found " + quoted(word));
      if (std::find(dofs.begin(), dofs.end(), *dof) != dofs.end()) {
        scanner_.fail_at(begin, quoted(word) + " is given twice");
      }
      dofs.push_back(*dof);
    }
    return dofs;
  }

  /// "XYZ" if the line ends.
  [[nodiscard]] std::string read_axis_order() {
    const std::string_view word = word_of_line();
    if (word.empty()) return "XYZ";
    std::string order;
    for (const char c : word) order += static_cast<char>(c >= 'a' && c <= 'z' ? c - 'a' + 'A' : c);
    std::string sorted = order;
    std::sort(sorted.begin(), sorted.end());
    if (sorted != "XYZ") {
      scanner_.fail_at(scanner_.offset() - word.size(),
                       "expected an order of axes such as XYZ, found " + quoted(word));
    }
    return order;
  }

  void read_bones() {
    while (next_line_of_section()) {
      const std::string_view word = scanner_.word();
      if (!equal_but_for_case(word, "begin")) {
        fail("expected 'begin' of a bone, found " + quoted(word));
      }
      if (draft_.bones.size() > static_cast<std::size_t>(kMaxAsfBones)) {
        fail("more than " + std::to_string(kMaxAsfBones) + " bones, the most that are read");
      }
      read_bone();
    }
  }

  void read_bone() {
    DraftBone bone;
    bone.begin = line_;
    for (;;) {
      if (!next_line_of_section()) {
        scanner_.fail_at(bone.begin, "this bone is never closed; an 'end' is missing");
      }
      if (scanner_.peek() == '(') continue;  // limits go on
      const std::string_view what = scanner_.word();
      if (equal_but_for_case(what, "end")) break;
      read_bone_line(bone, what);
    }
    if (bone.name.empty()) scanner_.fail_at(bone.begin, "the bone has no name; add a name line");
    const double norm = bone.direction.norm();
    if (bone.length != 0.0 && !(norm > 1e-6)) {
      scanner_.fail_at(bone.begin, "bone " + quoted(bone.name) +
                                       " has a length but no direction; add a direction line");
    }
    if (norm > 1e-6) bone.direction /= norm;
    draft_.bones.push_back(std::move(bone));
  }

  void read_bone_line(DraftBone& bone, std::string_view what) {
    if (equal_but_for_case(what, "name")) {
      read_name(bone);
    } else if (equal_but_for_case(what, "direction")) {
      bone.direction = three_numbers();
    } else if (equal_but_for_case(what, "length")) {
      bone.length = number();
      if (bone.length < 0.0) fail("the length of a bone must not be less than 0");
    } else if (equal_but_for_case(what, "axis")) {
      bone.angles = three_numbers();
      bone.axis_order = read_axis_order();
    } else if (equal_but_for_case(what, "dof")) {
      bone.dofs = read_dofs();
    } else if (equal_but_for_case(what, "begin")) {
      fail("a bone begins inside another; an 'end' before it is missing");
    } else if (!equal_but_for_case(what, "id") && !equal_but_for_case(what, "limits") &&
               !equal_but_for_case(what, "bodymass") && !equal_but_for_case(what, "cofmass")) {
      warnings_.add_once("bone line", line_, quoted(what) + " of a bone is ignored");
    }
  }

  void read_name(DraftBone& bone) {
    bone.name = word_of_line();
    const std::size_t begin = scanner_.offset() - bone.name.size();
    if (bone.name.empty()) fail("the bone has no name; write one after 'name'");
    if (!is_ascii(bone.name)) {
      scanner_.fail_at(begin, "the name of a bone must be of ASCII characters; rename it");
    }
    // A line of an AMC that begins with a digit is a frame's number.
    if (bone.name.front() >= '0' && bone.name.front() <= '9') {
      scanner_.fail_at(begin, "the name of a bone must not begin with a digit; rename it");
    }
    if (!index_.emplace(bone.name, static_cast<int>(draft_.bones.size())).second) {
      scanner_.fail_at(begin, "there is a bone " + quoted(bone.name) + " already; rename one");
    }
  }

  [[nodiscard]] int find_bone(std::string_view name) const {
    const auto found = index_.find(name);
    if (found == index_.end()) {
      scanner_.fail_at(scanner_.offset() - name.size(),
                       "there is no bone " + quoted(name) + " in the :bonedata before");
    }
    return found->second;
  }

  /// A line of the hierarchy: a parent and its children.
  void read_family() {
    const std::string_view parent_name = scanner_.word();
    if (equal_but_for_case(parent_name, "begin") || equal_but_for_case(parent_name, "end")) return;
    const int parent = find_bone(parent_name);
    for (std::string_view name = word_of_line(); !name.empty(); name = word_of_line()) {
      const int child = find_bone(name);
      DraftBone& bone = draft_.bones[static_cast<std::size_t>(child)];
      if (child == kRoot || bone.parent != kNoParent) {
        scanner_.fail_at(scanner_.offset() - name.size(),
                         child == kRoot ? "root cannot be the child of a bone"
                                        : "bone " + quoted(name) + " has a parent already");
      }
      bone.parent = parent;
      draft_.bones[static_cast<std::size_t>(parent)].children.push_back(child);
    }
  }

  /// Every bone goes back to the root: without that, bones would be lost or run in a circle.
  void require_all_connected() const {
    std::vector<bool> reached(draft_.bones.size(), false);
    std::vector<int> open = {kRoot};
    while (!open.empty()) {
      const auto bone = static_cast<std::size_t>(open.back());
      open.pop_back();
      reached[bone] = true;
      const std::vector<int>& children = draft_.bones[bone].children;
      open.insert(open.end(), children.begin(), children.end());
    }
    for (std::size_t i = 0; i < reached.size(); ++i) {
      if (reached[i]) continue;
      scanner_.fail_at(draft_.bones[i].begin,
                       "bone " + quoted(draft_.bones[i].name) +
                           (draft_.bones[i].parent == kNoParent
                                ? " has no parent; add it to a line of :hierarchy"
                                : " does not lead to the root; mend its lines of :hierarchy"));
    }
  }

  TextScanner& scanner_;
  Warnings& warnings_;
  Draft draft_;
  std::map<std::string_view, int> index_;
  std::size_t line_ = 0;  // where the current line begins
};

/// Rotation by three angles about fixed axes, the first letter's first.
Quaterniond axes_of(const DraftBone& bone, double radians) {
  Quaterniond axes = Quaterniond::Identity();
  for (std::size_t i = 0; i < 3; ++i) {
    const Eigen::Index axis = bone.axis_order[i] - 'X';
    const Vector3d turn =
        bone.angles[static_cast<Eigen::Index>(i)] * radians * Vector3d::Unit(axis);
    axes = math::exp(turn) * axes;
  }
  return axes.normalized();
}

/// Bones depth first, children in the order of the hierarchy.
std::vector<int> depth_first(const Draft& draft) {
  std::vector<int> order;
  std::vector<int> open = {kRoot};
  while (!open.empty()) {
    const int bone = open.back();
    open.pop_back();
    order.push_back(bone);
    const std::vector<int>& children = draft.bones[static_cast<std::size_t>(bone)].children;
    open.insert(open.end(), children.rbegin(), children.rend());
  }
  return order;
}

/// Joints in the file's unit, where bones begin.
std::vector<motion::Joint> make_joints(const Draft& draft, const std::vector<int>& order) {
  std::vector<int> joint_of_bone(draft.bones.size(), kNoParent);
  std::vector<motion::Joint> joints;
  for (const int index : order) {
    const DraftBone& bone = draft.bones[static_cast<std::size_t>(index)];
    joint_of_bone[static_cast<std::size_t>(index)] = static_cast<int>(joints.size());
    motion::Joint joint;
    joint.name = std::string(bone.name);
    joint.rest_offset = draft.root_position;
    if (index != kRoot) {
      const DraftBone& parent = draft.bones[static_cast<std::size_t>(bone.parent)];
      joint.parent = joint_of_bone[static_cast<std::size_t>(bone.parent)];
      joint.rest_offset = parent.length * parent.direction;
      if (bone.children.empty()) joint.end_site = bone.length * bone.direction;
    }
    joints.push_back(std::move(joint));
  }
  return joints;
}

double unit_of(const Draft& draft, const std::vector<motion::Joint>& joints,
               const AsfReadOptions& options, bool& guessed, Warnings& warnings) {
  const bool told = draft.length_scale && *draft.length_scale != 1.0;
  guessed = !options.unit_m && !told;
  if (options.unit_m) return *options.unit_m;
  return told ? kInchM / *draft.length_scale : guess_unit_m(joints, warnings);
}

}  // namespace

std::vector<std::string> AsfReadOptions::problems() const {
  if (!unit_m || (*unit_m > 0.0 && *unit_m <= 1e6)) return {};
  return {"AsfReadOptions::unit_m = " + std::to_string(*unit_m) + " (must be > 0 and at most 1e6)"};
}

AsfFile read_asf(std::string_view text, std::string_view name, const AsfReadOptions& options) {
  const std::vector<std::string> problems = options.problems();
  if (!problems.empty()) throw base::Error(base::ErrorKind::kUsage, problems.front());
  TextScanner scanner(text, name);
  Warnings warnings(scanner);
  const Draft draft = SectionReader(scanner, warnings).read();
  const std::vector<int> order = depth_first(draft);
  std::vector<motion::Joint> joints = make_joints(draft, order);
  AsfFile file;
  file.degrees = draft.degrees;
  file.unit_m = unit_of(draft, joints, options, file.unit_guessed, warnings);
  for (motion::Joint& joint : joints) {
    joint.rest_offset *= file.unit_m;
    if (joint.end_site) *joint.end_site *= file.unit_m;
  }
  for (const int index : order) {
    const DraftBone& bone = draft.bones[static_cast<std::size_t>(index)];
    file.joints.push_back(
        {axes_of(bone, draft.degrees ? math::kDegree : 1.0), bone.direction, bone.dofs});
  }
  file.skeleton = std::make_shared<const motion::Skeleton>(std::move(joints));
  file.warnings = warnings.take();
  return file;
}

motion::Clip rest_clip(const AsfFile& skeleton) {
  std::vector<Quaterniond> rotations(skeleton.joints.size(), Quaterniond::Identity());
  rotations.front() = skeleton.joints.front().axes;
  return {skeleton.skeleton, kUsualAmcRateHz, skeleton.skeleton->joint(0).rest_offset,
          std::move(rotations)};
}

}  // namespace laban::io
