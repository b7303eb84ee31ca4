#include "motion/rig_tables.h"

#include <cctype>
#include <cmath>
#include <tuple>

#include "laban/math/constants.h"

namespace laban::motion {
namespace {

using Names = std::vector<std::string>;
using Eigen::Vector3d;

Vector3d about_x(double degrees) {
  return {degrees * math::kDegree, 0.0, 0.0};
}
Vector3d about_z(double degrees) {
  return {0.0, 0.0, degrees * math::kDegree};
}

/// Names of one side, without the side: "*" stands for it.
struct SideNames {
  Names clavicle, upper_arm, forearm, hand, thigh, shin, foot, toe;
};

std::string with_side(std::string name, std::string_view side) {
  const auto star = name.find('*');
  return star == std::string::npos ? name : name.replace(star, 1, side);
}

void set_side(RigTable& table, const SideNames& names, std::string_view side,
              StandardJoint clavicle, StandardJoint thigh) {
  const auto set = [&](int index, const Names& of_joint) {
    for (const std::string& name : of_joint) {
      table.names[static_cast<std::size_t>(index)].push_back(with_side(name, side));
    }
  };
  int arm = index_of(clavicle);
  for (const Names* of_joint : {&names.clavicle, &names.upper_arm, &names.forearm, &names.hand}) {
    set(arm++, *of_joint);
  }
  int leg = index_of(thigh);
  for (const Names* of_joint : {&names.thigh, &names.shin, &names.foot, &names.toe}) {
    set(leg++, *of_joint);
  }
}

RigTable named(std::string rig_name, std::array<Names, 5> torso, const SideNames& sides,
               std::string_view left, std::string_view right) {
  RigTable table;
  table.rig_name = std::move(rig_name);
  for (std::size_t i = 0; i < torso.size(); ++i) table.names[i] = std::move(torso[i]);
  set_side(table, sides, left, StandardJoint::kLeftClavicle, StandardJoint::kLeftThigh);
  set_side(table, sides, right, StandardJoint::kRightClavicle, StandardJoint::kRightThigh);
  return table;
}

/// Names that MotionBuilder made common: CMU by cgspeed, Mixamo, LAFAN, HIK share them.
const SideNames kMotionBuilderSides = {{"*shoulder"}, {"*arm"}, {"*forearm"}, {"*hand"},
                                       {"*upleg"},    {"*leg"}, {"*foot"},    {"*toebase", "*toe"}};

/// Bandai-Namco: the zero pose lays every bone along its joint's x axis, away from the body on the
/// left and towards it on the right, so the axes are told here. Hinges: elbows bend about -y, knees
/// about +y of both sides (measured: such rotations are about those axes to 0.1 degrees in takes
/// without noise). The foot's x axis points at the toe joint: it falls by 39.6 degrees, the toe's
/// by 23.0, whenever a foot stands flat (median of all frames in which ankle and toe rest).
RigTable bandai() {
  RigTable table = named("bandai", {{{"hips"}, {"spine"}, {"chest"}, {"neck"}, {"head"}}},
                         {{"shoulder*"},
                          {"upperarm*"},
                          {"lowerarm*"},
                          {"hand*"},
                          {"upperleg*"},
                          {"lowerleg*"},
                          {"foot*"},
                          {"toes*"}},
                         "l", "r");
  table.signature = {"jointroot"};
  const Vector3d x = Vector3d::UnitX();
  const Vector3d y = Vector3d::UnitY();
  const Vector3d z = Vector3d::UnitZ();
  const auto slope = [](double degrees) {
    return Vector3d(0.0, -std::sin(degrees * math::kDegree), std::cos(degrees * math::kDegree));
  };
  using enum StandardJoint;
  table.axes.push_back({kHips, x, y, z, z});
  for (const StandardJoint joint : {kSpine, kChest, kNeck, kHead}) {
    table.axes.push_back({joint, x, y, y, z});
  }
  for (int i = 0; i < 4; ++i) {
    const auto left = static_cast<StandardJoint>(index_of(kLeftClavicle) + i);
    const auto right = static_cast<StandardJoint>(index_of(kRightClavicle) + i);
    table.axes.push_back({left, x, x, y, y});
    table.axes.push_back({right, -x, -x, -y, y});
  }
  const std::array<Vector3d, 4> leg_bones = {-y, -y, slope(39.6), slope(23.0)};
  for (int i = 0; i < 4; ++i) {
    const auto left = static_cast<StandardJoint>(index_of(kLeftThigh) + i);
    const auto right = static_cast<StandardJoint>(index_of(kRightThigh) + i);
    table.axes.push_back({left, x, leg_bones[static_cast<std::size_t>(i)], y, x});
    table.axes.push_back({right, -x, leg_bones[static_cast<std::size_t>(i)], y, x});
  }
  return table;
}

/// Hinges of CMU captures in the T-pose of cgspeed's two conversions: the radius of the ASF turns
/// about an axis 30 degrees off the vertical (both conversions agree to 0.3 degrees).
const LimbHint kCmuUpperArm = {
    StandardJoint::kLeftUpperArm, Vector3d::Zero(), {-0.121, -0.858, 0.500}};
const LimbHint kCmuForearm = {
    StandardJoint::kLeftForearm, Vector3d::Zero(), {-0.121, -0.858, 0.500}};
const LimbHint kCmuThigh = {StandardJoint::kLeftThigh, Vector3d::Zero(), Vector3d::UnitX()};
const LimbHint kCmuShin = {StandardJoint::kLeftShin, Vector3d::Zero(), Vector3d::UnitX()};

/// cgspeed's 31-joint conversion of the CMU captures for MotionBuilder.
RigTable cmu_31() {
  RigTable table = named("cmu-31", {{{"hips"}, {"spine"}, {"spine1"}, {"neck"}, {"head"}}},
                         kMotionBuilderSides, "left", "right");
  table.signature = {"lhipjoint", "lowerback"};
  table.t_pose_frame = true;
  // The same in every file seen.
  table.t_pose = {{"leftupleg", about_z(-21.0)}, {"rightupleg", about_z(21.0)},
                  {"neck", about_x(-16.0)},      {"neck1", about_x(21.0)},
                  {"head", about_x(11.0)},       {"leftarm", about_z(-8.0)},
                  {"rightarm", about_z(8.0)}};
  table.limbs = {kCmuUpperArm, kCmuForearm, kCmuThigh, kCmuShin};
  return table;
}

/// cgspeed's 43-joint conversion of the CMU captures for Daz figures. The figure's own bones bend
/// the elbow by 17 degrees and turn the feet out by 5 where the captured body, as the 31-joint
/// files have it, is straight; rotations away from the T-pose frame agree with the 31-joint files
/// to 2-4 degrees. So the captured body's directions stand in for the figure's. The T-pose frame
/// bends the figure's knees by up to 7 degrees to bring its feet to the captured body's, which
/// stands straight: compared with the ASF, a shin is straight where it is not turned at all.
RigTable cmu_43() {
  RigTable table = named(
      "cmu-43", {{{"hip"}, {"abdomen"}, {"chest"}, {"neck"}, {"head"}}},
      {{"*collar"}, {"*shldr"}, {"*forearm"}, {"*hand"}, {"*thigh"}, {"*shin"}, {"*foot"}, {}}, "l",
      "r");
  table.signature = {"abdomen", "lbuttock"};
  table.t_pose_frame = true;
  const Vector3d arm(std::cos(8.0 * math::kDegree), -std::sin(8.0 * math::kDegree), 0.0);
  const Vector3d leg = -Vector3d::UnitY();
  table.limbs = {kCmuUpperArm,
                 kCmuForearm,
                 kCmuThigh,
                 kCmuShin,
                 {StandardJoint::kLeftFoot, Vector3d::UnitZ(), Vector3d::Zero()}};
  table.limbs[0].bone = arm;
  table.limbs[1].bone = arm;
  table.limbs[2].bone = leg;
  table.limbs[3].bone = leg;
  table.unbent = {StandardJoint::kLeftShin, StandardJoint::kRightShin};
  return table;
}

RigTable mixamo() {
  RigTable table = named("mixamo",
                         {{{"hips"},
                           {"spine"},
                           {"spine5", "spine4", "spine3", "spine2", "spine1"},
                           {"neck"},
                           {"head"}}},
                         kMotionBuilderSides, "left", "right");
  table.prefix = "mixamorig";
  return table;
}

/// Ubisoft's LAFAN1: MotionBuilder's names, but the zero pose lays every bone along its joint's x
/// axis. Axes as in the first frame of its files, a T-pose to about 10 degrees: the torso's x up, y
/// forward; legs' x down, y forward; arms' x outward, y backward. The foot's x axis falls to the
/// toe by 25 degrees where it stands flat.
RigTable lafan() {
  RigTable table = named(
      "lafan1", {{{"hips"}, {"spine"}, {"spine2"}, {"neck"}, {"head"}}},
      {{"*shoulder"}, {"*arm"}, {"*forearm"}, {"*hand"}, {"*upleg"}, {"*leg"}, {"*foot"}, {"*toe"}},
      "left", "right");
  const Vector3d x = Vector3d::UnitX();
  const Vector3d y = Vector3d::UnitY();
  const Vector3d z = Vector3d::UnitZ();
  using enum StandardJoint;
  for (const StandardJoint joint : {kHips, kSpine, kChest, kNeck, kHead}) {
    table.axes.push_back({joint, x, y, y, z});
  }
  const Vector3d foot(0.0, -std::sin(25.0 * math::kDegree), std::cos(25.0 * math::kDegree));
  const std::array<Vector3d, 4> leg_bones = {-y, -y, foot, z};
  for (const auto& [clavicle, thigh, outward] :
       {std::tuple(kLeftClavicle, kLeftThigh, x),
        std::tuple(kRightClavicle, kRightThigh, Vector3d(-x))}) {
    for (int i = 0; i < 4; ++i) {
      table.axes.push_back({static_cast<StandardJoint>(index_of(clavicle) + i), x, outward, y, -z});
      table.axes.push_back({static_cast<StandardJoint>(index_of(thigh) + i), x,
                            leg_bones[static_cast<std::size_t>(i)], z, -x});
    }
  }
  return table;
}

/// Blender's Rigify, metarig and deformation bones ("DEF-upper_arm.L"): one chain of spine bones
/// from the pelvis ("spine") to the head ("spine.006").
RigTable rigify() {
  return named(
      "rigify",
      {{{"spine"}, {"spine001"}, {"spine003"}, {"spine004", "neck"}, {"spine006", "head"}}},
      {{"shoulder*"},
       {"upperarm*"},
       {"forearm*"},
       {"hand*"},
       {"thigh*"},
       {"shin*"},
       {"foot*"},
       {"toe*"}},
      "l", "r");
}

/// SMPL, SMPL-H and HumanML3D: joints named by the joint, "L_Hip" or "left_hip".
RigTable smpl() {
  const SideNames sides = {{"*collar"}, {"*shoulder"}, {"*elbow"}, {"*wrist"},
                           {"*hip"},    {"*knee"},     {"*ankle"}, {"*foot"}};
  RigTable table =
      named("smpl", {{{"pelvis"}, {"spine1"}, {"spine3"}, {"neck"}, {"head"}}}, sides, "l", "r");
  set_side(table, sides, "left", StandardJoint::kLeftClavicle, StandardJoint::kLeftThigh);
  set_side(table, sides, "right", StandardJoint::kRightClavicle, StandardJoint::kRightThigh);
  return table;
}

RigTable standard() {
  RigTable table;
  table.rig_name = "standard";
  for (std::size_t i = 0; i < kStandardJointCount; ++i) {
    table.names[i] = {normalised_joint_name(kStandardJointNames[i])};
  }
  return table;
}

RigTable motion_builder() {
  return named("motionbuilder",
               {{{"hips", "pelvis"},
                 {"spine", "spine1"},
                 {"spine9", "spine8", "spine7", "spine6", "spine5", "spine4", "spine3", "spine2",
                  "spine1", "chest"},
                 {"neck", "neck1"},
                 {"head"}}},
               kMotionBuilderSides, "left", "right");
}

RigTable biped() {
  return named(
      "3ds-max-biped",
      {{{"pelvis"}, {"spine"}, {"spine3", "spine2", "spine1"}, {"neck", "neck1"}, {"head"}}},
      {{"*clavicle"},
       {"*upperarm"},
       {"*forearm"},
       {"*hand"},
       {"*thigh"},
       {"*calf"},
       {"*foot"},
       {"*toe0"}},
      "l", "r");
}

RigTable unreal() {
  return named("unreal",
               {{{"pelvis"},
                 {"spine01"},
                 {"spine05", "spine04", "spine03", "spine02"},
                 {"neck01"},
                 {"head"}}},
               {{"clavicle*"},
                {"upperarm*"},
                {"lowerarm*"},
                {"hand*"},
                {"thigh*"},
                {"calf*"},
                {"foot*"},
                {"ball*"}},
               "l", "r");
}

const SideNames kUnitySides = {{"*shoulder"}, {"*upperarm"}, {"*lowerarm"}, {"*hand"},
                               {"*upperleg"}, {"*lowerleg"}, {"*foot"},     {"*toes", "*toebase"}};

RigTable unity() {
  return named("unity", {{{"hips"}, {"spine"}, {"upperchest", "chest"}, {"neck"}, {"head"}}},
               kUnitySides, "left", "right");
}

RigTable vrm() {
  return named("vrm", {{{"chips"}, {"cspine"}, {"cupperchest", "cchest"}, {"cneck"}, {"chead"}}},
               kUnitySides, "l", "r");
}

RigTable xsens() {
  return named("xsens", {{{"pelvis", "hips"}, {"l3", "l5"}, {"t8", "t12"}, {"neck"}, {"head"}}},
               {{"*shoulder"},
                {"*upperarm"},
                {"*forearm"},
                {"*hand"},
                {"*upperleg"},
                {"*lowerleg"},
                {"*foot"},
                {"*toe"}},
               "left", "right");
}

RigTable xsens_bvh() {
  return named("xsens-bvh",
               {{{"hips"}, {"chest", "spine"}, {"chest4", "chest3", "chest2"}, {"neck"}, {"head"}}},
               {{"*collar"},
                {"*shoulder"},
                {"*elbow"},
                {"*wrist"},
                {"*hip"},
                {"*knee"},
                {"*ankle"},
                {"*toe"}},
               "left", "right");
}

RigTable rokoko() {
  return named(
      "rokoko",
      {{{"hips"}, {"spine1", "spine"}, {"spine4", "spine3", "spine2"}, {"neck"}, {"head"}}},
      {{"*shoulder"},
       {"*arm"},
       {"*forearm"},
       {"*hand"},
       {"*thigh"},
       {"*shin"},
       {"*foot"},
       {"*toe"}},
      "left", "right");
}

/// Bones of ASF files (CMU, HDM05), each named as the joint it begins at. Vicon BodyBuilder wrote
/// them all: arms level, legs and feet as one spread by 20 degrees, and the radius turns about an
/// axis 30 degrees off the vertical. The head's zero is not level: cgspeed's conversions give the
/// neck's and head's turns of a T-pose on this very skeleton. The hand is "lwrist", the far half of
/// the forearm that turns about it, as in cgspeed's conversions; its bend, at "lhand", stays the
/// rig's own.
RigTable acclaim() {
  RigTable table =
      named("acclaim", {{{"root"}, {"upperback"}, {"thorax"}, {"lowerneck"}, {"head"}}},
            {{"*clavicle"},
             {"*humerus"},
             {"*radius"},
             {"*wrist", "*hand"},
             {"*femur"},
             {"*tibia"},
             {"*foot"},
             {"*toes"}},
            "l", "r");
  table.t_pose = {{"lfemur", about_z(-20.0)},
                  {"rfemur", about_z(20.0)},
                  {"lowerneck", about_x(-16.0)},
                  {"upperneck", about_x(21.0)},
                  {"head", about_x(11.0)}};
  const Vector3d elbow(0.0, -std::cos(30.0 * math::kDegree), std::sin(30.0 * math::kDegree));
  table.limbs = {{StandardJoint::kLeftUpperArm, Vector3d::Zero(), elbow},
                 {StandardJoint::kLeftForearm, Vector3d::Zero(), elbow},
                 kCmuThigh,
                 kCmuShin};
  return table;
}

std::vector<RigTable> build_tables() {
  return {bandai(),         cmu_31(), cmu_43(),  lafan(),  mixamo(), standard(),
          motion_builder(), biped(),  unreal(),  unity(),  vrm(),    xsens(),
          xsens_bvh(),      rokoko(), acclaim(), rigify(), smpl()};
}

}  // namespace

const std::vector<RigTable>& rig_tables() {
  static const std::vector<RigTable> tables = build_tables();
  return tables;
}

std::string normalised_joint_name(std::string_view name) {
  const auto space = name.find_last_of(":|/");
  if (space != std::string_view::npos && space + 1 < name.size()) name.remove_prefix(space + 1);
  for (const std::string_view prefix : {"DEF-", "DEF_", "ORG-"}) {
    if (name.starts_with(prefix) && name.size() > prefix.size()) name.remove_prefix(prefix.size());
  }
  std::string plain;
  for (const char c : name) {
    const auto letter = static_cast<unsigned char>(c);
    if (std::isalnum(letter) != 0 || letter >= 0x80) {
      plain.push_back(static_cast<char>(std::tolower(letter)));
    }
  }
  for (const std::string_view prefix : {"mixamorig", "character", "valvebiped", "jbip", "bip"}) {
    if (plain.compare(0, prefix.size(), prefix) != 0) continue;
    std::size_t end = prefix.size();
    while (end < plain.size() && std::isdigit(static_cast<unsigned char>(plain[end])) != 0) ++end;
    if (end < plain.size()) plain.erase(0, end);
  }
  return plain;
}

}  // namespace laban::motion
