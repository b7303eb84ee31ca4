// Are styled clips as clean as captures? The figures: ten clips (or INPUTS), each of one
// performer (or style) whom the model does not know, given four targets; foot skate, toes in the
// floor, acceleration at joins and jerk beside those of the captures that the outputs are made of,
// with and without held feet. Every second input joins three takes of the performer, so that there
// are joins of another kind too.
//
// Usage: quality_study FOLDER PATTERN [INPUTS [ONLY [WRITE_FOLDER]]]
//   e.g. PATTERN 'dataset-1_{content}_{performer}_{take}'
//   ONLY is an input's number from 0 on, or "all"; inputs, outputs and sources are written to
//   WRITE_FOLDER as BVH, to be looked at.

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <filesystem>
#include <limits>
#include <numeric>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "laban/align/dtw.h"
#include "laban/base/error.h"
#include "laban/io/clip_file.h"
#include "laban/math/statistics.h"
#include "laban/motion/forward_kinematics.h"
#include "laban/motion/humanoid.h"
#include "laban/motion/join.h"
#include "laban/motion/resample.h"
#include "laban/motion/retarget.h"
#include "laban/transfer/apply_style.h"
#include "laban/transfer/style_corpus.h"
#include "laban/transfer/style_model.h"
#include "laban/transfer/styled_clip.h"

#include "observed_corpus.h"
#include "takes.h"

namespace {

using namespace laban;
using studies::Take;

struct Input {
  std::string name;
  std::string performer;
  motion::Capture capture;
};

/// Several takes of one performer as one capture on the first one's rig.
motion::Capture joined(const std::vector<const Take*>& takes) {
  std::vector<motion::PoseMatrix> parts;
  const motion::Capture& first = takes.front()->capture;
  for (const Take* take : takes) {
    parts.push_back(
        motion::resample(motion::to_pose_matrix(take->capture.clip, take->capture.humanoid),
                         first.clip.frame_rate_hz()));
  }
  // As calm as outputs are: what an input does where its takes meet is not the output's doing.
  motion::PoseMatrix all = motion::concatenate(parts, transfer::ApplyOptions{}.join);
  all.leg_length_m = first.humanoid.leg_length_m();
  return {motion::from_pose_matrix(all, first.humanoid, first.clip),
          first.humanoid.without_t_pose_frame()};
}

std::vector<Input> choose_inputs(const std::vector<Take>& takes, std::size_t count) {
  const std::vector<std::string> performers = studies::performers_of(takes);
  std::vector<Input> inputs;
  for (std::size_t n = 0; n < count; ++n) {
    const std::string& performer = performers[n % performers.size()];
    std::vector<const Take*> own;
    for (const Take& take : takes) {
      if (take.performer == performer) own.push_back(&take);
    }
    std::vector<const Take*> chosen;
    for (std::size_t k = 0; k < (n % 2 == 0 ? 1U : 3U); ++k)
      chosen.push_back(own[(n + 2 * k) % own.size()]);
    std::string name;
    for (const Take* take : chosen) name += (name.empty() ? "" : " + ") + take->name;
    inputs.push_back({name, performer, joined(chosen)});
  }
  return inputs;
}

std::vector<transfer::EffortTarget> targets() {
  const auto target = [](std::optional<double> flow, std::optional<double> weight,
                         std::optional<double> time) {
    return transfer::EffortTarget{{flow, weight, time}, {1.0, 1.0, 1.0, 1.0}};
  };
  return {target(-2.0, std::nullopt, std::nullopt), target(std::nullopt, 2.0, std::nullopt),
          target(std::nullopt, std::nullopt, 2.0), target(1.5, -1.5, -1.5)};
}

/// Where a clip jerks most: the joint and the 0.2 s whose third differences, relative to the hips,
/// are largest, and their share of all.
struct JerkPeak {
  std::string joint;
  int frame = 0;
  double share = 0.0;
};

JerkPeak jerk_peak(const motion::Clip& clip, const motion::Humanoid& humanoid) {
  const int frames = clip.frame_count();
  const Eigen::Matrix3Xd all = motion::joint_positions(clip);
  const int hips = humanoid.mapped(motion::StandardJoint::kHips)->joint;
  const auto at = [&](int f, int joint) {
    const Eigen::Index first = static_cast<Eigen::Index>(f) * clip.joint_count();
    return Eigen::Vector3d(all.col(first + joint) - all.col(first + hips));
  };
  JerkPeak peak;
  double sum = 0.0, most = 0.0;
  const int reach = static_cast<int>(std::lround(0.1 * clip.frame_rate_hz()));
  for (int s = 0; s < motion::kStandardJointCount; ++s) {
    const auto& mapped = humanoid.mapped(static_cast<motion::StandardJoint>(s));
    if (!mapped) continue;
    std::vector<double> squares;
    for (int f = 0; f + 3 < frames; ++f) {
      const int joint = mapped->joint;
      squares.push_back(
          (at(f + 3, joint) - 3.0 * at(f + 2, joint) + 3.0 * at(f + 1, joint) - at(f, joint))
              .squaredNorm());
      sum += squares.back();
    }
    for (int f = 0; f < static_cast<int>(squares.size()); ++f) {
      const int begin = std::max(f - reach, 0);
      const int end = std::min(f + reach + 1, static_cast<int>(squares.size()));
      const double around = std::accumulate(squares.begin() + begin, squares.begin() + end, 0.0);
      if (around <= most) continue;
      most = around;
      peak.joint = clip.skeleton().joint(mapped->joint).name;
      peak.frame = f + 1;
    }
  }
  peak.share = sum > 0.0 ? most / sum : 0.0;
  return peak;
}

/// One apply, measured beside its sources.
struct Row {
  transfer::StyledQuality quality;
  int joins = 0;
  double above_source_floor_m = 0.0;  ///< 2nd percentile of toe height over the sources' floor
  std::optional<double> content_ratio;
  int snippets = 0;
  int named = 0;               ///< snippets whose nearest group is still the action
  double missed_alone = 0.0;   ///< by what is asked, Effort points, each snippet's blend by itself
  double missed_joined = 0.0;  ///< the same of its frames of the output
  std::string misnamed;
};

/// The mean pose of each performer of a model, as its database has it.
std::map<int, Eigen::VectorXd> mean_poses(const transfer::StyleModel& model) {
  std::map<int, std::vector<motion::PoseMatrix>> poses;
  std::map<int, std::vector<int>> contents;
  for (std::size_t k = 0; k < model.fragments.size(); ++k) {
    const int performer = model.database.performers()[k];
    poses[performer].push_back(model.fragments[k].pose);
    contents[performer].push_back(model.contents.numbers[k]);
  }
  std::map<int, Eigen::VectorXd> means;
  for (const auto& [performer, own] : poses) {
    means[performer] = model.database.metric().mean_pose(own, contents.at(performer));
  }
  return means;
}

/// The group of the database's fragment of least mean DTW cost to features of the same metric; the
/// fragments `made_of` are not asked.
struct Named {
  int group = -1;
  std::vector<double> least;  ///< cost of each group's nearest
};

Named nearest_group(const align::FragmentSet& database, const Eigen::MatrixXd& features,
                    const std::vector<int>& made_of) {
  const int groups = *std::max_element(database.groups().begin(), database.groups().end()) + 1;
  Named named{-1, std::vector<double>(static_cast<std::size_t>(groups),
                                      std::numeric_limits<double>::infinity())};
  for (int k = 0; k < database.fragment_count(); ++k) {
    if (std::find(made_of.begin(), made_of.end(), k) != made_of.end()) continue;
    const auto cell = static_cast<std::size_t>(k);
    double& least = named.least[static_cast<std::size_t>(database.groups()[cell])];
    least = std::min(least, align::dtw_cost(features, database.features()[cell]).mean_cost());
  }
  named.group = static_cast<int>(std::min_element(named.least.begin(), named.least.end()) -
                                 named.least.begin());
  return named;
}

/// Names what a snippet shows. The content metric looks at poses relative to the performer's mean
/// pose over all contents: that of a blend is blended from its performers' as the blend is from
/// their fragments. (Relative to its own mean, a take whose mean pose is what sets it apart looks
/// like another content: of Bandai's 105 takes 90 were named so, 98 relative to their performer's.)
class ActionNamer {
 public:
  explicit ActionNamer(const transfer::StyleModel& model)
      : model_(model), mean_poses_(mean_poses(model)) {}

  [[nodiscard]] Named name(const motion::PoseMatrix& pose,
                           const transfer::BlendChoice& choice) const {
    Eigen::VectorXd mean = Eigen::VectorXd::Zero(align::kContentRowCount);
    std::vector<int> made_of;
    for (const transfer::BlendShare& share : choice.shares()) {
      const int performer = model_.database.performers()[static_cast<std::size_t>(share.fragment)];
      mean += share.weight * mean_poses_.at(performer);
      made_of.push_back(share.fragment);
    }
    return nearest_group(model_.database, model_.database.metric().features(pose, mean), made_of);
  }

 private:
  const transfer::StyleModel& model_;
  std::map<int, Eigen::VectorXd> mean_poses_;
};

void count_named(const transfer::StyleModel& model, const ActionNamer& namer,
                 const transfer::AppliedStyle& applied, Row& row) {
  for (const transfer::AppliedSnippet& snippet : applied.snippets) {
    if (snippet.kept) continue;
    ++row.snippets;
    const int group = model.contents.numbers[static_cast<std::size_t>(snippet.fragment)];
    const Named named =
        namer.name(applied.pose.slice(snippet.output_begin, snippet.output_end), snippet.choice);
    if (named.group == group) {
      ++row.named;
      continue;
    }
    const auto told = [&](int g) {
      char cost[32];
      std::snprintf(cost, sizeof cost, " %.2f", named.least[static_cast<std::size_t>(g)]);
      return model.contents.names[static_cast<std::size_t>(g)] + cost;
    };
    row.misnamed += "  " + told(group) + " named " + told(named.group) + " (of";
    for (const transfer::BlendShare& share : snippet.choice.shares())
      row.misnamed += ' ' + model.fragments[static_cast<std::size_t>(share.fragment)].name;
    row.misnamed += ")";
  }
}

/// How many unstyled takes of the left-out performer the same classifier names, relative to his
/// mean pose: what it can do at best.
struct Ceiling {
  int takes = 0;
  int named = 0;
};

Ceiling ceiling(const transfer::StyleModel& model, const std::vector<transfer::Fragment>& fragments,
                const std::string& performer) {
  const align::FragmentSet& database = model.database;
  const auto& names = model.contents.names;
  std::vector<motion::PoseMatrix> poses;
  std::vector<int> groups;
  for (const transfer::Fragment& fragment : fragments) {
    const auto known = std::find(names.begin(), names.end(), fragment.content);
    if (fragment.performer != performer || known == names.end()) continue;
    poses.push_back(fragment.pose);
    groups.push_back(static_cast<int>(known - names.begin()));
  }
  Ceiling found{static_cast<int>(poses.size()), 0};
  if (poses.empty()) return found;
  const Eigen::VectorXd mean = database.metric().mean_pose(poses, groups);
  for (std::size_t n = 0; n < poses.size(); ++n) {
    const Eigen::MatrixXd features = database.metric().features(poses[n], mean);
    found.named += nearest_group(database, features, {}).group == groups[n] ? 1 : 0;
  }
  return found;
}

void measure_misses(const transfer::StyleModel& model, const transfer::AppliedStyle& applied,
                    Row& row) {
  const auto joined = transfer::measure_snippets(model, applied);
  for (std::size_t n = 0; n < joined.size(); ++n) {
    const transfer::AppliedSnippet& snippet = applied.snippets[n];
    if (snippet.kept) continue;
    row.missed_alone += snippet.asked.distance_to(effort::to_vector(snippet.measured.effort));
    row.missed_joined += snippet.asked.distance_to(effort::to_vector(joined[n].effort));
  }
}

struct Column {
  std::vector<double> values;
  void print(const char* name, const char* unit) const {
    if (values.empty()) return;
    std::printf("  %-44s mean %8.3f  median %8.3f  90th %8.3f  worst %8.3f %s\n", name,
                math::mean(values), math::median(values), math::percentile(values, 90.0),
                *std::max_element(values.begin(), values.end()), unit);
  }
};

void print_table(const char* title, const std::vector<Row>& rows, double capture_skate) {
  Column skate, own_skate, sunk, sunk_source, jerk, joins, contents;
  int snippets = 0, named = 0, named_applies = 0;
  double missed_alone = 0.0, missed_joined = 0.0;
  int skate_held = 0, sunk_held = 0, jerk_held = 0, joins_held = 0;
  for (const Row& row : rows) {
    const auto& q = row.quality;
    skate.values.push_back(q.output.foot_skate_cm);
    own_skate.values.push_back(q.source_skate_cm);
    sunk.values.push_back(-100.0 * q.output.toe_height_m);
    sunk_source.values.push_back(-100.0 * row.above_source_floor_m);
    jerk.values.push_back(q.output.jerk_m_s3 / q.source_jerk_m_s3);
    skate_held += q.output.foot_skate_cm <= 1.1 * q.source_skate_cm ? 1 : 0;
    sunk_held += row.above_source_floor_m >= -0.01 ? 1 : 0;
    jerk_held += jerk.values.back() <= 1.5 ? 1 : 0;
    if (row.content_ratio) contents.values.push_back(*row.content_ratio);
    snippets += row.snippets;
    named += row.named;
    missed_alone += row.missed_alone;
    missed_joined += row.missed_joined;
    named_applies += row.named == row.snippets ? 1 : 0;
    if (!q.join_percentile) continue;
    joins.values.push_back(*q.join_percentile);
    joins_held += *q.join_percentile <= 99.0 ? 1 : 0;
  }
  std::printf("%s, %zu applies\n", title, rows.size());
  skate.print("foot skate", "cm/frame");
  own_skate.print("  of their sources on the input's body", "cm/frame");
  std::printf("  %-44s %.3f of their sources', %.3f of all captures' on their own rigs (%.3f)\n",
              "  ratio of means (bar 1.1)", math::mean(skate.values) / math::mean(own_skate.values),
              math::mean(skate.values) / capture_skate, capture_skate);
  sunk_source.print("toes below the sources' floor, 2nd percentile", "cm");
  sunk.print("  below the floor it is to stand on", "cm");
  jerk.print("jerk over that of the sources (bar 1.5)", "");
  joins.print("worst join's percentile in captures (bar 99)", "%");
  contents.print("content: DTW cost to the input over the usual one (bar 1)", "");
  std::printf("  nearest group names the action: %d of %d snippets, all snippets of %d of %zu\n",
              named, snippets, named_applies, rows.size());
  std::printf("  what is asked is missed by %.3f Effort points, %.3f before snippets are joined\n",
              missed_joined / snippets, missed_alone / snippets);
  std::printf("  within the bar: skate %d, toes %d, jerk %d of %zu; joins %d of %zu\n", skate_held,
              sunk_held, jerk_held, rows.size(), joins_held, joins.values.size());
}

void print_ceiling(const std::map<std::string, Ceiling>& ceilings) {
  Ceiling all;
  for (const auto& [performer, one] : ceilings) {
    all.takes += one.takes;
    all.named += one.named;
  }
  std::printf("unstyled takes that their nearest group names: %d of %d\n", all.named, all.takes);
}

/// All captures at the rate of the first, for the accelerations.
struct Captures {
  double skate_cm = 0.0;
  std::vector<motion::MotionQuality> qualities;
};

Captures print_captures(const std::vector<Take>& takes) {
  Captures captures;
  Column skates, toes, floors, heels;
  for (const Take& take : takes) {
    const auto found = motion::find_foot_contacts(take.capture.clip, take.capture.humanoid);
    if (!found.floor) {
      std::printf("no contact in %s\n", take.name.c_str());
      continue;
    }
    const auto quality =
        motion::measure_quality(take.capture.clip, take.capture.humanoid, *found.floor);
    captures.qualities.push_back(quality);
    skates.values.push_back(quality.foot_skate_cm);
    toes.values.push_back(-100.0 * quality.toe_height_m);
    floors.values.push_back(100.0 * found.floor->toe_m);
    heels.values.push_back(100.0 * found.floor->heel_m);
  }
  std::printf("%zu captures\n", takes.size());
  skates.print("foot skate", "cm/frame");
  toes.print("toes below the floor, 2nd percentile", "cm");
  floors.print("height of toes in contact", "cm");
  heels.print("height of heels in contact", "cm");
  std::printf("  toe floors from %.2f to %.2f cm\n",
              *std::min_element(floors.values.begin(), floors.values.end()),
              *std::max_element(floors.values.begin(), floors.values.end()));
  captures.skate_cm = math::mean(skates.values);
  return captures;
}

struct Study {
  std::filesystem::path folder;
  std::string pattern;
  std::size_t inputs = 10;
  std::optional<std::size_t> only;             ///< one input alone
  std::optional<std::filesystem::path> write;  ///< where clips are put to be looked at
};

/// One apply as it is printed: input, feet held or not, and what was done.
struct Apply {
  const Input& input;
  const transfer::AppliedStyle& applied;
  transfer::StyledClip styled;
  const transfer::StyledSources& sources;
  bool feet_held = false;
};

void print_apply(const Apply& apply, const Row& row) {
  const auto& q = row.quality;
  std::printf("%-60s %-3s joins %d skate %.3f/%.3f toes %+.2f cm jerk %.2f join %.1f",
              apply.input.name.c_str(), apply.feet_held ? "on" : "off", row.joins,
              q.output.foot_skate_cm, q.source_skate_cm, 100.0 * q.output.toe_height_m,
              q.output.jerk_m_s3 / q.source_jerk_m_s3, q.join_percentile.value_or(-1.0));
  std::printf("  alphas");
  for (const auto& snippet : apply.applied.snippets) std::printf(" %+.2f", snippet.choice.alpha);
  const JerkPeak peak = jerk_peak(apply.styled.clip, apply.input.capture.humanoid);
  std::printf("  peak %s at %d of %d, %.0f %%", peak.joint.c_str(), peak.frame,
              apply.styled.clip.frame_count(), 100.0 * peak.share);
  if (apply.feet_held) {
    std::printf("  stances %d steps %d farthest %.1f cm", apply.styled.foot_stances,
                apply.styled.foot_steps, 100.0 * apply.styled.farthest_foot_m);
  }
  std::printf("%s\n", row.misnamed.c_str());
}

void write_clips(const std::filesystem::path& folder, const std::string& name, const Apply& apply) {
  const io::WriteOptions overwrite{.force = true};
  const std::string stem = name + (apply.feet_held ? "_held" : "_free");
  io::write_clip(folder / (stem + ".bvh"), apply.styled.clip, overwrite);
  if (apply.feet_held) return;
  io::write_clip(folder / (name + "_input.bvh"), apply.input.capture.clip, overwrite);
  for (std::size_t n = 0; n < apply.sources.clips.size(); ++n) {
    io::write_clip(folder / (name + "_source_" + std::to_string(n) + ".bvh"),
                   apply.sources.clips[n], overwrite);
  }
}

Row measure(const transfer::StyleModel& model, const ActionNamer& namer, const Apply& apply,
            const motion::PoseMatrix& pose, const Captures& captures) {
  const transfer::StyledClip& styled = apply.styled;
  Row row;
  row.quality = transfer::measure_styled(styled, apply.sources, apply.input.capture.humanoid);
  row.joins = static_cast<int>(styled.joins.size());
  row.content_ratio = transfer::content_ratio(model, apply.applied, pose);
  count_named(model, namer, apply.applied, row);
  measure_misses(model, apply.applied, row);
  if (styled.floor && apply.sources.floor) {
    row.above_source_floor_m =
        row.quality.output.toe_height_m + styled.floor->toe_m - apply.sources.floor->toe_m;
  }
  row.quality.join_percentile =
      motion::join_acceleration_percentile(row.quality.output, styled.joins, captures.qualities);
  return row;
}

void run(const Study& study) {
  const std::vector<Take> takes = studies::read_takes(study.folder, study.pattern);
  const std::vector<transfer::Fragment> fragments = studies::fragments_of(takes);
  const Captures captures = print_captures(takes);
  const std::vector<Input> inputs = choose_inputs(takes, study.inputs);
  const transfer::ApplyOptions options{.rounds = transfer::kRounds};  // as `laban apply` does
  std::map<std::string, Ceiling> ceilings;
  std::vector<Row> off, on;
  for (std::size_t n = 0; n < inputs.size(); ++n) {
    if (study.only && *study.only != n) continue;
    const Input& input = inputs[n];
    const transfer::StyleModel model = studies::model_without(fragments, input.performer);
    const ActionNamer namer(model);
    if (!ceilings.contains(input.performer))
      ceilings[input.performer] = ceiling(model, fragments, input.performer);
    const motion::PoseMatrix pose = motion::resample(
        motion::to_pose_matrix(input.capture.clip, input.capture.humanoid), model.frame_rate_hz());
    for (std::size_t t = 0; t < targets().size(); ++t) {
      const transfer::AppliedStyle applied =
          transfer::apply_style(model, pose, targets()[t], options);
      const transfer::StyledSources sources = transfer::play_sources(model, applied, input.capture);
      for (const bool hold_feet : {false, true}) {
        const Apply apply{
            input, applied,
            transfer::play_style(model, applied, input.capture, {.hold_feet = hold_feet}), sources,
            hold_feet};
        const Row row = measure(model, namer, apply, pose, captures);
        print_apply(apply, row);
        if (study.write)
          write_clips(*study.write, std::to_string(n) + "_" + std::to_string(t), apply);
        (hold_feet ? on : off).push_back(row);
      }
    }
  }
  print_table("feet as blended", off, captures.skate_cm);
  print_table("feet held", on, captures.skate_cm);
  print_ceiling(ceilings);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 3 || argc > 6) {
    std::fprintf(stderr, "usage: quality_study FOLDER PATTERN [INPUTS [ONLY [WRITE_FOLDER]]]\n");
    return 2;
  }
  try {
    Study study{argv[1], argv[2]};
    if (argc > 3) study.inputs = static_cast<std::size_t>(std::atoi(argv[3]));
    if (argc > 4 && std::string(argv[4]) != "all")
      study.only = static_cast<std::size_t>(std::atoi(argv[4]));
    if (argc > 5) study.write = argv[5];
    run(study);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "quality_study: %s\n", error.what());
    return 1;
  }
  return 0;
}
