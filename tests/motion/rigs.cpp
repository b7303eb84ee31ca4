#include "rigs.h"

#include <array>
#include <cmath>
#include <optional>
#include <utility>

#include "laban/base/rng.h"
#include "laban/math/rotation.h"

namespace laban::test {

using Eigen::Vector3d;
using motion::Clip;
using motion::Joint;
using motion::Skeleton;
using motion::StandardJoint;

namespace {

/// Where joints of one body are in the T-pose, metres; of the left side, for those that have one.
const std::map<std::string, Vector3d> kPlaces = {
    {"root", {0.0, 0.0, 0.0}},          {"hips", {0.0, 0.99, 0.0}},
    {"spine", {0.0, 1.09, 0.0}},        {"spine b", {0.0, 1.17, 0.0}},
    {"spine c", {0.0, 1.22, 0.0}},      {"spine d", {0.0, 1.28, 0.0}},
    {"chest", {0.0, 1.34, 0.0}},        {"neck", {0.0, 1.49, 0.0}},
    {"neck b", {0.0, 1.54, 0.01}},      {"head", {0.0, 1.59, 0.02}},
    {"head end", {0.0, 1.78, 0.02}},    {"clavicle", {0.06, 1.43, 0.0}},
    {"upper arm", {0.18, 1.43, 0.0}},   {"upper arm twist", {0.30, 1.43, 0.0}},
    {"forearm", {0.46, 1.43, 0.0}},     {"forearm twist", {0.60, 1.43, 0.0}},
    {"hand", {0.73, 1.43, 0.0}},        {"finger", {0.83, 1.43, 0.02}},
    {"finger b", {0.86, 1.43, 0.02}},   {"thumb", {0.76, 1.42, 0.03}},
    {"hip", {0.06, 0.95, 0.0}},         {"thigh", {0.09, 0.92, 0.0}},
    {"thigh twist", {0.09, 0.70, 0.0}}, {"shin", {0.09, 0.48, 0.0}},
    {"foot", {0.09, 0.07, 0.0}},        {"toe", {0.09, 0.01, 0.13}},
    {"toe end", {0.09, 0.0, 0.19}}};

/// Standard joints of a place, left and right (or both the same).
const std::map<std::string, std::array<StandardJoint, 2>> kPlayed = {
    {"hips", {StandardJoint::kHips, StandardJoint::kHips}},
    {"spine", {StandardJoint::kSpine, StandardJoint::kSpine}},
    {"chest", {StandardJoint::kChest, StandardJoint::kChest}},
    {"neck", {StandardJoint::kNeck, StandardJoint::kNeck}},
    {"head", {StandardJoint::kHead, StandardJoint::kHead}},
    {"clavicle", {StandardJoint::kLeftClavicle, StandardJoint::kRightClavicle}},
    {"upper arm", {StandardJoint::kLeftUpperArm, StandardJoint::kRightUpperArm}},
    {"forearm", {StandardJoint::kLeftForearm, StandardJoint::kRightForearm}},
    {"hand", {StandardJoint::kLeftHand, StandardJoint::kRightHand}},
    {"thigh", {StandardJoint::kLeftThigh, StandardJoint::kRightThigh}},
    {"shin", {StandardJoint::kLeftShin, StandardJoint::kRightShin}},
    {"foot", {StandardJoint::kLeftFoot, StandardJoint::kRightFoot}},
    {"toe", {StandardJoint::kLeftToe, StandardJoint::kRightToe}}};

/// One joint of a rig; '*' in names stands for the side.
struct Row {
  std::string name, parent, place;
};

struct RigRows {
  std::string rig_name, left, right;
  std::vector<Row> rows;
  double arms_down_degrees = 0.0;
};

std::string with_side(std::string name, const std::string& side) {
  const auto star = name.find('*');
  return star == std::string::npos ? name : name.replace(star, 1, side);
}

/// Model position of a place on a side, arms turned down about the shoulder.
Vector3d place_of(const std::string& place, double side, double arms_down_degrees) {
  Vector3d position = kPlaces.at(place);
  const Vector3d shoulder = kPlaces.at("upper arm");
  if (position.x() > shoulder.x()) {
    position =
        shoulder + math::exp({0.0, 0.0, -arms_down_degrees * kDegree}) * (position - shoulder);
  }
  position.x() *= side;
  return position;
}

NamedRig build(const RigRows& rig) {
  std::vector<Joint> joints;
  std::map<std::string, std::pair<int, Vector3d>> placed;
  std::map<StandardJoint, std::string> expected;
  const auto add = [&](const Row& row, const std::string& side_name, int side) {
    const std::string name = with_side(row.name, side_name);
    const Vector3d position = place_of(row.place, side == 0 ? 1.0 : -1.0, rig.arms_down_degrees);
    Joint joint;
    joint.name = name;
    joint.rest_offset = position;
    if (!row.parent.empty()) {
      const auto& [index, parent_position] = placed.at(with_side(row.parent, side_name));
      joint.parent = index;
      joint.rest_offset = position - parent_position;
    }
    placed[name] = {static_cast<int>(joints.size()), position};
    joints.push_back(std::move(joint));
    const auto played = kPlayed.find(row.place);
    if (played != kPlayed.end()) expected[played->second[static_cast<std::size_t>(side)]] = name;
  };
  for (const Row& row : rig.rows) {
    if (row.name.find('*') == std::string::npos) add(row, "", 0);
  }
  for (const int side : {0, 1}) {
    for (const Row& row : rig.rows) {
      if (row.name.find('*') != std::string::npos) add(row, side == 0 ? rig.left : rig.right, side);
    }
  }
  return {rig.rig_name, Skeleton(std::move(joints)), rig.arms_down_degrees, std::move(expected)};
}

/// MotionBuilder's names behind a prefix, as HIK and Mixamo have them.
std::vector<Row> motion_builder_rows(const std::string& prefix) {
  std::vector<Row> rows = {{"Hips", "", "hips"},
                           {"Spine", "Hips", "spine"},
                           {"Spine1", "Spine", "spine c"},
                           {"Spine2", "Spine1", "chest"},
                           {"Neck", "Spine2", "neck"},
                           {"Head", "Neck", "head"},
                           {"HeadTop_End", "Head", "head end"},
                           {"*Shoulder", "Spine2", "clavicle"},
                           {"*Arm", "*Shoulder", "upper arm"},
                           {"*ArmRoll", "*Arm", "upper arm twist"},
                           {"*ForeArm", "*Arm", "forearm"},
                           {"*ForeArmRoll", "*ForeArm", "forearm twist"},
                           {"*Hand", "*ForeArm", "hand"},
                           {"*HandThumb1", "*Hand", "thumb"},
                           {"*HandIndex1", "*Hand", "finger"},
                           {"*UpLeg", "Hips", "thigh"},
                           {"*Leg", "*UpLeg", "shin"},
                           {"*Foot", "*Leg", "foot"},
                           {"*ToeBase", "*Foot", "toe"},
                           {"*Toe_End", "*ToeBase", "toe end"}};
  for (Row& row : rows) {
    row.name.insert(0, prefix);
    if (!row.parent.empty()) row.parent.insert(0, prefix);
  }
  return rows;
}

/// Unreal's mannequins, as the engine's template skeletons name them: four (UE4: SK_Mannequin,
/// three spine joints, one neck) and five (SKM_Manny, five and two), twist joints on every limb.
RigRows unreal_rows(bool five) {
  RigRows rig{
      "unreal", "l", "r", {{"root", "", "root"}, {"pelvis", "root", "hips"}}, five ? 50.0 : 45.0};
  const std::vector<Row> spine = five ? std::vector<Row>{{"spine_01", "pelvis", "spine"},
                                                         {"spine_02", "spine_01", "spine b"},
                                                         {"spine_03", "spine_02", "spine c"},
                                                         {"spine_04", "spine_03", "spine d"},
                                                         {"spine_05", "spine_04", "chest"},
                                                         {"neck_01", "spine_05", "neck"},
                                                         {"neck_02", "neck_01", "neck b"},
                                                         {"head", "neck_02", "head"}}
                                      : std::vector<Row>{{"spine_01", "pelvis", "spine"},
                                                         {"spine_02", "spine_01", "spine b"},
                                                         {"spine_03", "spine_02", "chest"},
                                                         {"neck_01", "spine_03", "neck"},
                                                         {"head", "neck_01", "head"}};
  rig.rows.insert(rig.rows.end(), spine.begin(), spine.end());
  const std::string chest = five ? "spine_05" : "spine_03";
  const std::vector<Row> sides = {{"clavicle_*", chest, "clavicle"},
                                  {"upperarm_*", "clavicle_*", "upper arm"},
                                  {"upperarm_twist_01_*", "upperarm_*", "upper arm twist"},
                                  {"lowerarm_*", "upperarm_*", "forearm"},
                                  {"lowerarm_twist_01_*", "lowerarm_*", "forearm twist"},
                                  {"hand_*", "lowerarm_*", "hand"},
                                  {"index_01_*", "hand_*", "finger"},
                                  {"thumb_01_*", "hand_*", "thumb"},
                                  {"thigh_*", "pelvis", "thigh"},
                                  {"thigh_twist_01_*", "thigh_*", "thigh twist"},
                                  {"calf_*", "thigh_*", "shin"},
                                  {"foot_*", "calf_*", "foot"},
                                  {"ball_*", "foot_*", "toe"},
                                  {"ik_hand_*", "root", "finger"},
                                  {"ik_foot_*", "root", "toe end"}};
  rig.rows.insert(rig.rows.end(), sides.begin(), sides.end());
  return rig;
}

/// Unity's HumanBodyBones, and the same behind VRoid's prefix (VRM 0.x and 1.0).
RigRows unity_rows(const std::string& rig_name, const std::string& middle, const std::string& side,
                   const std::string& left, const std::string& right, const std::string& toe) {
  return {rig_name,
          left,
          right,
          {{middle + "Hips", "", "hips"},
           {middle + "Spine", middle + "Hips", "spine"},
           {middle + "Chest", middle + "Spine", "spine c"},
           {middle + "UpperChest", middle + "Chest", "chest"},
           {middle + "Neck", middle + "UpperChest", "neck"},
           {middle + "Head", middle + "Neck", "head"},
           {side + "Shoulder", middle + "UpperChest", "clavicle"},
           {side + "UpperArm", side + "Shoulder", "upper arm"},
           {side + "LowerArm", side + "UpperArm", "forearm"},
           {side + "Hand", side + "LowerArm", "hand"},
           {side + "IndexProximal", side + "Hand", "finger"},
           {side + "ThumbProximal", side + "Hand", "thumb"},
           {side + "UpperLeg", middle + "Hips", "thigh"},
           {side + "LowerLeg", side + "UpperLeg", "shin"},
           {side + "Foot", side + "LowerLeg", "foot"},
           {side + toe, side + "Foot", "toe"}}};
}

}  // namespace

std::vector<NamedRig> upright_rigs() {
  std::vector<RigRows> rigs = {
      {"mixamo", "Left", "Right", motion_builder_rows("mixamorig:")},
      {"mixamo", "Left", "Right", motion_builder_rows("Armature|mixamorig7_")},
      // Autodesk's HumanIK, as MotionBuilder's characterisation and Maya's namespaces name it.
      {"motionbuilder", "Left", "Right", motion_builder_rows("Character1_")},
      {"motionbuilder", "Left", "Right", motion_builder_rows("hero:Character1_")},
      {"motionbuilder", "Left", "Right", motion_builder_rows("")},
      unreal_rows(false),
      unreal_rows(true),
      unity_rows("unity", "", "*", "Left", "Right", "Toes"),
      unity_rows("vrm", "J_Bip_C_", "J_Bip_*_", "L", "R", "ToeBase"),
      // 3ds Max Biped: names as Character Studio makes them; Bip001 in later versions.
      {"3ds-max-biped",
       "L",
       "R",
       {{"Bip01", "", "root"},
        {"Bip01 Pelvis", "Bip01", "hips"},
        {"Bip01 Spine", "Bip01 Pelvis", "spine"},
        {"Bip01 Spine1", "Bip01 Spine", "spine c"},
        {"Bip01 Spine2", "Bip01 Spine1", "chest"},
        {"Bip01 Neck", "Bip01 Spine2", "neck"},
        {"Bip01 Head", "Bip01 Neck", "head"},
        {"Bip01 HeadNub", "Bip01 Head", "head end"},
        {"Bip01 * Clavicle", "Bip01 Neck", "clavicle"},
        {"Bip01 * UpperArm", "Bip01 * Clavicle", "upper arm"},
        {"Bip01 * Forearm", "Bip01 * UpperArm", "forearm"},
        {"Bip01 * ForeTwist", "Bip01 * Forearm", "forearm twist"},
        {"Bip01 * Hand", "Bip01 * Forearm", "hand"},
        {"Bip01 * Finger0", "Bip01 * Hand", "thumb"},
        {"Bip01 * Finger1", "Bip01 * Hand", "finger"},
        {"Bip01 * Finger1Nub", "Bip01 * Finger1", "finger b"},
        {"Bip01 * Thigh", "Bip01 Pelvis", "thigh"},
        {"Bip01 * Calf", "Bip01 * Thigh", "shin"},
        {"Bip01 * Foot", "Bip01 * Calf", "foot"},
        {"Bip01 * Toe0", "Bip01 * Foot", "toe"},
        {"Bip01 * Toe0Nub", "Bip01 * Toe0", "toe end"}}},
      // Xsens MVN's BVH export.
      {"xsens-bvh",
       "Left",
       "Right",
       {{"Hips", "", "hips"},
        {"Chest", "Hips", "spine"},
        {"Chest2", "Chest", "spine b"},
        {"Chest3", "Chest2", "spine c"},
        {"Chest4", "Chest3", "chest"},
        {"Neck", "Chest4", "neck"},
        {"Head", "Neck", "head"},
        {"*Collar", "Chest4", "clavicle"},
        {"*Shoulder", "*Collar", "upper arm"},
        {"*Elbow", "*Shoulder", "forearm"},
        {"*Wrist", "*Elbow", "hand"},
        {"*Hip", "Hips", "thigh"},
        {"*Knee", "*Hip", "shin"},
        {"*Ankle", "*Knee", "foot"},
        {"*Toe", "*Ankle", "toe"}}},
      // Xsens MVN's segments, as its FBX and MVNX name them.
      {"xsens",
       "Left",
       "Right",
       {{"Pelvis", "", "hips"},
        {"L5", "Pelvis", "spine b"},
        {"L3", "L5", "spine"},
        {"T12", "L3", "spine d"},
        {"T8", "T12", "chest"},
        {"Neck", "T8", "neck"},
        {"Head", "Neck", "head"},
        {"*Shoulder", "T8", "clavicle"},
        {"*UpperArm", "*Shoulder", "upper arm"},
        {"*ForeArm", "*UpperArm", "forearm"},
        {"*Hand", "*ForeArm", "hand"},
        {"*UpperLeg", "Pelvis", "thigh"},
        {"*LowerLeg", "*UpperLeg", "shin"},
        {"*Foot", "*LowerLeg", "foot"},
        {"*Toe", "*Foot", "toe"}}},
      // Rokoko's Newton skeleton.
      {"rokoko",
       "Left",
       "Right",
       {{"Root", "", "root"},
        {"Hips", "Root", "hips"},
        {"Spine1", "Hips", "spine"},
        {"Spine2", "Spine1", "spine b"},
        {"Spine3", "Spine2", "spine c"},
        {"Spine4", "Spine3", "chest"},
        {"Neck", "Spine4", "neck"},
        {"Head", "Neck", "head"},
        {"*Shoulder", "Spine4", "clavicle"},
        {"*Arm", "*Shoulder", "upper arm"},
        {"*ForeArm", "*Arm", "forearm"},
        {"*Hand", "*ForeArm", "hand"},
        {"*Digit2Metacarpal", "*Hand", "finger"},
        {"*Thigh", "Hips", "thigh"},
        {"*Shin", "*Thigh", "shin"},
        {"*Foot", "*Shin", "foot"},
        {"*Toe", "*Foot", "toe"},
        {"*ToeTip", "*Toe", "toe end"}}},
      // Blender's Rigify: deformation bones, limbs in two halves.
      {"rigify",
       "L",
       "R",
       {{"DEF-spine", "", "hips"},
        {"DEF-spine.001", "DEF-spine", "spine"},
        {"DEF-spine.002", "DEF-spine.001", "spine c"},
        {"DEF-spine.003", "DEF-spine.002", "chest"},
        {"DEF-spine.004", "DEF-spine.003", "neck"},
        {"DEF-spine.005", "DEF-spine.004", "neck b"},
        {"DEF-spine.006", "DEF-spine.005", "head"},
        {"DEF-shoulder.*", "DEF-spine.003", "clavicle"},
        {"DEF-upper_arm.*", "DEF-shoulder.*", "upper arm"},
        {"DEF-upper_arm.*.001", "DEF-upper_arm.*", "upper arm twist"},
        {"DEF-forearm.*", "DEF-upper_arm.*.001", "forearm"},
        {"DEF-forearm.*.001", "DEF-forearm.*", "forearm twist"},
        {"DEF-hand.*", "DEF-forearm.*.001", "hand"},
        {"DEF-f_index.01.*", "DEF-hand.*", "finger"},
        {"DEF-thigh.*", "DEF-spine", "thigh"},
        {"DEF-thigh.*.001", "DEF-thigh.*", "thigh twist"},
        {"DEF-shin.*", "DEF-thigh.*.001", "shin"},
        {"DEF-foot.*", "DEF-shin.*", "foot"},
        {"DEF-toe.*", "DEF-foot.*", "toe"}}},
      // SMPL's 24 joints.
      {"smpl",
       "L",
       "R",
       {{"Pelvis", "", "hips"},
        {"Spine1", "Pelvis", "spine"},
        {"Spine2", "Spine1", "spine c"},
        {"Spine3", "Spine2", "chest"},
        {"Neck", "Spine3", "neck"},
        {"Head", "Neck", "head"},
        {"*_Collar", "Spine3", "clavicle"},
        {"*_Shoulder", "*_Collar", "upper arm"},
        {"*_Elbow", "*_Shoulder", "forearm"},
        {"*_Wrist", "*_Elbow", "hand"},
        {"*_Hand", "*_Wrist", "finger"},
        {"*_Hip", "Pelvis", "thigh"},
        {"*_Knee", "*_Hip", "shin"},
        {"*_Ankle", "*_Knee", "foot"},
        {"*_Foot", "*_Ankle", "toe"}}}};
  std::vector<NamedRig> built;
  for (const RigRows& rig : rigs) built.push_back(build(rig));
  return built;
}

Skeleton lafan_skeleton() {
  // Offsets of the data set's files, centimetres.
  struct Row {
    const char* name;
    int parent;
    Vector3d offset;
  };
  const std::vector<Row> rows = {{"Hips", -1, {0.0, 91.9, 0.0}},
                                 {"LeftUpLeg", 0, {0.103, 1.858, 10.549}},
                                 {"LeftLeg", 1, {43.5, 0.0, 0.0}},
                                 {"LeftFoot", 2, {42.372, 0.0, 0.0}},
                                 {"LeftToe", 3, {17.3, 0.0, 0.0}},
                                 {"RightUpLeg", 0, {0.103, 1.858, -10.549}},
                                 {"RightLeg", 5, {43.5, 0.0, 0.0}},
                                 {"RightFoot", 6, {42.372, 0.0, 0.0}},
                                 {"RightToe", 7, {17.3, 0.0, 0.0}},
                                 {"Spine", 0, {6.902, -2.604, 0.0}},
                                 {"Spine1", 9, {12.588, 0.0, 0.0}},
                                 {"Spine2", 10, {12.343, 0.0, 0.0}},
                                 {"Neck", 11, {25.833, 0.0, 0.0}},
                                 {"Head", 12, {11.767, 0.0, 0.0}},
                                 {"LeftShoulder", 11, {19.746, -1.48, 6.0}},
                                 {"LeftArm", 14, {11.284, 0.0, 0.0}},
                                 {"LeftForeArm", 15, {33.0, 0.0, 0.0}},
                                 {"LeftHand", 16, {25.2, 0.0, 0.0}},
                                 {"RightShoulder", 11, {19.746, -1.48, -6.0}},
                                 {"RightArm", 18, {11.284, 0.0, 0.0}},
                                 {"RightForeArm", 19, {33.0, 0.0, 0.0}},
                                 {"RightHand", 20, {25.2, 0.0, 0.0}}};
  std::vector<Joint> joints;
  for (const Row& row : rows)
    joints.push_back({row.name, row.parent, 0.01 * row.offset, std::nullopt});
  return Skeleton(std::move(joints));
}

Clip lafan_first_frame() {
  // Degrees about z, y, x in this order, of the joints above.
  constexpr std::array<std::array<double, 3>, 22> kAngles = {{
      {91.911, 5.797, 88.877},    {-173.826, -1.357, 177.800}, {-8.189, -1.406, -8.436},
      {72.185, 4.507, -5.155},    {21.455, 0.003, 0.0},        {-171.433, 6.949, -171.417},
      {-10.045, 3.093, 10.020},   {77.536, -5.597, 6.281},     {21.455, -0.003, 0.0},
      {6.939, -0.425, 0.084},     {3.863, -0.857, 0.160},      {3.545, -0.856, 0.162},
      {5.063, -5.967, -2.955},    {-18.982, 10.359, -7.857},   {-95.385, -86.110, -86.694},
      {-1.745, 13.837, -10.454},  {-23.352, -15.926, 1.190},   {8.270, -3.008, 30.897},
      {-101.167, 82.061, 81.176}, {-5.484, -12.039, 6.738},    {-22.245, 15.927, -1.200},
      {7.053, 3.370, -14.329},
  }};
  std::vector<Eigen::Quaterniond> rotations;
  for (const auto& [z, y, x] : kAngles) {
    const Eigen::Quaterniond q = math::exp({0.0, 0.0, z * kDegree}) *
                                 math::exp({0.0, y * kDegree, 0.0}) *
                                 math::exp({x * kDegree, 0.0, 0.0});
    rotations.push_back(q.normalized());
  }
  return {std::make_shared<const Skeleton>(lafan_skeleton()), 30.0, Vector3d(-2.247, 0.919, -4.316),
          std::move(rotations)};
}

Skeleton mixamo_skeleton() {
  std::vector<Joint> joints;
  const auto add = [&joints](const std::string& name, const std::string& parent, double x, double y,
                             double z) {
    int index = -1;
    for (std::size_t i = 0; i < joints.size(); ++i) {
      if (joints[i].name == "mixamorig:" + parent) index = static_cast<int>(i);
    }
    joints.push_back({"mixamorig:" + name, index, {x, y, z}, std::nullopt});
  };
  add("Hips", "", 0.0, 0.99, 0.01);
  add("Spine", "Hips", 0.0, 0.099, -0.012);
  add("Spine1", "Spine", 0.0, 0.117, 0.0);
  add("Spine2", "Spine1", 0.0, 0.134, 0.0);
  add("Neck", "Spine2", 0.0, 0.150, 0.0);
  add("Head", "Neck", 0.0, 0.096, 0.031);
  for (const double side : {1.0, -1.0}) {
    const std::string of = side > 0.0 ? "Left" : "Right";
    add(of + "Shoulder", "Spine2", side * 0.061, 0.091, 0.007);
    add(of + "Arm", of + "Shoulder", side * 0.127, -0.001, -0.024);
    add(of + "ForeArm", of + "Arm", side * 0.274, 0.0, 0.0);
    add(of + "Hand", of + "ForeArm", side * 0.276, 0.0, 0.0);
    add(of + "HandIndex1", of + "Hand", side * 0.123, -0.002, 0.028);
    add(of + "UpLeg", "Hips", side * 0.091, -0.067, 0.0);
    add(of + "Leg", of + "UpLeg", 0.0, -0.443, 0.003);
    add(of + "Foot", of + "Leg", 0.0, -0.445, -0.030);
    add(of + "ToeBase", of + "Foot", side * 0.01, -0.098, 0.120);
  }
  return Skeleton(std::move(joints));
}

Clip at_rest(const Skeleton& skeleton) {
  const auto joints = static_cast<std::size_t>(skeleton.joint_count());
  return {std::make_shared<const Skeleton>(skeleton), 30.0, skeleton.joint(0).rest_offset,
          std::vector<Eigen::Quaterniond>(joints, Eigen::Quaterniond::Identity())};
}

Clip random_motion(const Skeleton& skeleton, int frames, unsigned seed) {
  base::Rng rng(seed);
  std::vector<Eigen::Vector3d> phases;
  for (int j = 0; j < skeleton.joint_count(); ++j) {
    phases.emplace_back(rng.uniform(0, 6), rng.uniform(0, 6), rng.uniform(0, 6));
  }
  Eigen::Matrix3Xd root(3, frames);
  std::vector<Eigen::Quaterniond> rotations;
  for (int f = 0; f < frames; ++f) {
    const double t = f / 60.0;
    root.col(f) << 0.3 * t, 0.95 + 0.03 * std::sin(7.0 * t), 1.1 * t;
    for (int j = 0; j < skeleton.joint_count(); ++j) {
      const Eigen::Array3d phase = phases[static_cast<std::size_t>(j)].array();
      const Eigen::Quaterniond local = math::exp((0.7 * (2.0 * t + phase).sin()).matrix());
      rotations.push_back(j == 0 ? math::yaw_rotation(5.0 * t) * local : local);
    }
  }
  return {std::make_shared<const Skeleton>(skeleton), 60.0, std::move(root), std::move(rotations)};
}

}  // namespace laban::test
