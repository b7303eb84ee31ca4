#include "files.h"

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <iostream>
#include <iterator>
#include <map>

#include <fmt/core.h>

#include "laban/base/error.h"
#include "laban/base/sha256.h"
#include "laban/base/version.h"
#include "laban/math/constants.h"
#include "laban/motion/resample.h"
#include "laban/motion/retarget.h"

#include "number_checks.h"

namespace laban::cli {
namespace {

namespace fs = std::filesystem;
using base::Error;
using base::ErrorKind;

/// How io is to read the clip of a path, or of stdin for "-".
io::ReadOptions io_options(const ReadClipOptions& options, const std::string& path) {
  io::ReadOptions reading{.unit_m = options.unit_m, .frame_rate_hz = options.frame_rate_hz};
  reading.up_axis = up_axis_named(options.up_axis);
  if (path != "-") reading.folder = fs::path(path).parent_path();
  if (!options.skeleton.empty()) reading.skeleton = options.skeleton;
  if (!options.animation.empty()) reading.animation = options.animation;
  if (!options.input_format.empty()) reading.input_format = options.input_format;
  if (path == "-" && options.input_format.empty()) {
    throw Error(ErrorKind::kUsage, "reading from stdin needs --input-format");
  }
  return reading;
}

fs::path executable_folder() {
  std::error_code failed;
  const fs::path self = fs::read_symlink("/proc/self/exe", failed);
  return failed ? fs::path(".") : self.parent_path();
}

/// A clip of the corpus, read once however many fragments it has.
using ClipCache = std::map<std::string, CapturedClip>;

std::optional<effort::Effort> effort_of(const effort::LabelRow& row) {
  if (!row.is_rated()) return std::nullopt;
  return effort::Effort{*row.flow, *row.weight, *row.time, row.space.value_or(0.0)};
}

transfer::Fragment make_fragment(const effort::LabelRow& row, const CapturedClip& clip,
                                 double rate_hz) {
  const motion::Clip& whole = clip.file.clip;
  const int t_pose = whole.frame_count() - clip.capture.clip.frame_count();
  const int begin = row.begin_frame.value_or(t_pose);
  const int end = row.end_frame.value_or(whole.frame_count());
  if (begin < t_pose || end > whole.frame_count() || begin >= end) {
    throw Error(ErrorKind::kData, "frames [" + std::to_string(begin) + ", " + std::to_string(end) +
                                      ") do not lie in the frames [" + std::to_string(t_pose) +
                                      ", " + std::to_string(whole.frame_count()) + ") of " +
                                      row.clip);
  }
  const motion::Clip cut =
      motion::resample(clip.capture.clip.slice(begin - t_pose, end - t_pose), rate_hz);
  transfer::Fragment fragment{row.fragment, row.content, row.performer,
                              motion::to_pose_matrix(cut, clip.capture.humanoid), effort_of(row)};
  return fragment;
}

/// The table as its observers gave it, or one of them.
effort::LabelTable chosen_labels(effort::LabelTable table, const std::string& path,
                                 const ReadCorpusOptions& options) {
  if (options.rater.empty()) return table;
  return naming(path, [&] { return effort::only_observer(table, options.rater); });
}

/// Numbers of fragments by their names.
using IndexOf = std::map<std::string, int>;

transfer::CorpusBlend make_blend(const effort::LabelRow& row, const IndexOf& index, double weight) {
  transfer::CorpusBlend blend{row.fragment, index.at(row.parent_i), index.at(row.parent_j),
                              *row.alpha, effort_of(row)};
  if (blend.effort) blend.weight = weight;
  return blend;
}

/// Blends with the mean of their labels.
void add_means(const effort::LabelTable& labels, const IndexOf& index, LabelledCorpus& read) {
  const std::vector<double> weights = effort::mean_weights(labels);
  for (std::size_t n = 0; n < read.table.rows.size(); ++n) {
    const effort::LabelRow& row = read.table.rows[n];
    if (row.is_blend()) read.corpus.blends.push_back(make_blend(row, index, weights[n]));
  }
}

/// Blends, once for every observer who gives all three factors. Those that no one has rated stand
/// once without a label, as among the means; those that observers have rated only between them are
/// left out.
/// @return observations of one or two factors, which cannot be learnt from by themselves.
int add_observations(const effort::LabelTable& labels, const IndexOf& index, LabelledCorpus& read) {
  std::map<std::string, std::vector<const effort::LabelRow*>> whole;
  int parts = 0;
  const effort::LabelTable judgements = effort::mean_over_repeats(labels);
  for (const effort::LabelRow& row : judgements.rows) {
    if (!row.is_blend()) continue;
    if (row.is_rated())
      whole[row.fragment].push_back(&row);
    else if (row.flow || row.weight || row.time)
      ++parts;
  }
  for (const effort::LabelRow& row : read.table.rows) {
    if (!row.is_blend()) continue;
    if (!row.is_rated()) read.corpus.blends.push_back(make_blend(row, index, 1.0));
    for (const effort::LabelRow* one : whole[row.fragment]) {
      read.corpus.blends.push_back(make_blend(*one, index, one->confidence.value_or(1.0)));
    }
  }
  return parts;
}

/// Space is learnt where every label that counts gives it: some are too few to learn it from.
int factors_of(const effort::LabelTable& labels, const std::string& path, const Common& common) {
  int rated = 0;
  int with_space = 0;
  for (const effort::LabelRow& row : labels.rows) {
    if (!row.is_rated()) continue;
    ++rated;
    if (row.space) ++with_space;
  }
  if (rated > 0 && with_space == rated) return effort::kMaxFactorCount;
  if (with_space > 0) {
    warn(common, fmt::format("{}: Space is left out, {} of {} labels have none; fill them in to "
                             "learn it",
                             path, rated - with_space, rated));
  }
  return effort::kFactorCount;
}

}  // namespace

Json finite_or_null(double value) {
  return std::isfinite(value) ? Json(value) : Json();
}

motion::PoseMatrix CapturedClip::pose(std::optional<double> frame_rate_hz) const {
  return motion::to_pose_matrix(
      frame_rate_hz ? motion::resample(capture.clip, *frame_rate_hz) : capture.clip,
      capture.humanoid);
}

motion::HumanoidOptions read_map(const std::string& path) {
  motion::HumanoidOptions found;
  if (path.empty()) return found;
  return naming(path, [&] {
    const Json json = Json::parse(base::read_file(path), nullptr, false);
    if (!json.is_object()) {
      throw Error(ErrorKind::kFormat, "a map is one JSON object: {\"hips\": \"joint name\", ..}");
    }
    for (const auto& [standard, name] : json.items()) {
      const auto& names = motion::kStandardJointNames;
      const auto place = std::find(names.begin(), names.end(), standard);
      if (place == names.end() || !name.is_string()) {
        throw Error(ErrorKind::kFormat, "'" + standard +
                                            "' is not a standard joint with a joint name; "
                                            "'laban inspect' lists the standard joints");
      }
      found.joint_names[static_cast<motion::StandardJoint>(place - names.begin())] =
          name.get<std::string>();
    }
    return found;
  });
}

std::optional<motion::UpAxis> up_axis_named(const std::string& name) {
  if (name == "x") return motion::UpAxis::kX;
  if (name == "y") return motion::UpAxis::kY;
  if (name == "z") return motion::UpAxis::kZ;
  return std::nullopt;
}

std::string name_of(motion::UpAxis up) {
  return up == motion::UpAxis::kX ? "x" : up == motion::UpAxis::kY ? "y" : "z";
}

void add_read_options(CLI::App* verb, ReadClipOptions& options) {
  const std::string group = "Reading clips";
  verb->add_option("--unit", options.unit_m,
                   "metres per unit of the input file (default: guessed from the body)")
      ->check(positive_number())
      ->group(group);
  verb->add_option("--fps", options.frame_rate_hz, "frame rate of the input, instead of the file's")
      ->check(positive_number())
      ->group(group);
  verb->add_option("--input-format", options.input_format,
                   "format of the input (needed for '-', stdin): bvh, gltf, asf or amc")
      ->group(group);
  verb->add_option("--skeleton", options.skeleton,
                   "ASF file of AMC motion (default: found beside it by its name)")
      ->group(group);
  verb->add_option("--input-up", options.up_axis,
                   "axis of the input that points up: x, y or z (default: found from the body)")
      ->check(CLI::IsMember({"x", "y", "z"}))
      ->group(group);
  verb->add_option("--map", options.map,
                   "JSON file {\"hips\": \"joint name\", ..} for a rig that is not known")
      ->group(group);
  verb->add_option("--animation", options.animation,
                   "which animation of a glTF file: its name or index (default: the first)")
      ->group(group);
}

void add_write_options(CLI::App* verb, WriteClipOptions& options) {
  const std::string group = "Writing clips";
  verb->add_option("--format", options.format,
                   "format of the output (needed for '-', stdout): bvh or glb")
      ->group(group);
  verb->add_option("--up", options.up_axis, "axis that points up in a BVH output: x, y or z")
      ->check(CLI::IsMember({"x", "y", "z"}))
      ->capture_default_str()
      ->group(group);
  verb->add_flag("--no-mesh", options.no_mesh,
                 "GLB: the joints and their animation alone, neither bones nor character")
      ->group(group);
  verb->add_flag("--compact", options.compact, "GLB: fewer and shorter keys, within a tolerance")
      ->group(group);
  verb->add_option("--compact-tolerance", options.compact_tolerance_deg,
                   "greatest error of a joint's rotation, degrees (default 0.1); implies --compact")
      ->check(positive_number())
      ->group(group);
}

motion::Clip with_standard_names(const motion::Clip& clip, const motion::Humanoid& humanoid) {
  std::vector<motion::Joint> joints = clip.skeleton().joints();
  for (int j = 0; j < clip.joint_count(); ++j) {
    if (const auto part = humanoid.played_by(j)) {
      joints[static_cast<std::size_t>(j)].name =
          motion::kStandardJointNames[static_cast<std::size_t>(motion::index_of(*part))];
    }
  }
  std::vector<Eigen::Quaterniond> rotations;
  Eigen::Matrix3Xd translations;
  if (clip.has_translations()) {
    translations.resize(3, static_cast<Eigen::Index>(clip.frame_count()) * clip.joint_count());
  }
  for (int f = 0; f < clip.frame_count(); ++f) {
    const auto frame = clip.rotations(f);
    for (int j = 0; j < clip.joint_count() && clip.has_translations(); ++j) {
      translations.col(std::ssize(rotations) + j) = clip.translation(f, j);
    }
    rotations.insert(rotations.end(), frame.begin(), frame.end());
  }
  return {std::make_shared<const motion::Skeleton>(std::move(joints)), clip.frame_rate_hz(),
          clip.root_positions(), std::move(rotations), std::move(translations)};
}

std::string read_bytes(const std::string& path) {
  if (path != "-") return base::read_file(path);
  return {std::istreambuf_iterator<char>(std::cin), std::istreambuf_iterator<char>()};
}

io::ClipFile parse_any_clip(const std::string& path, const std::string& bytes,
                            const ReadClipOptions& options, const Common& common) {
  io::ClipFile file =
      io::parse_clip(bytes, path == "-" ? "stdin" : path, io_options(options, path));
  for (const std::string& warning : file.warnings) warn(common, warning);
  if (options.up_axis.empty() && file.up_axis != motion::UpAxis::kY) {
    warn(common, path + ": read with +" + name_of(file.up_axis) +
                     " up, as the body stands; --input-up y if it lies");
  }
  return file;
}

io::ClipFile read_any_clip(const std::string& path, const ReadClipOptions& options,
                           const Common& common) {
  return parse_any_clip(path, read_bytes(path), options, common);
}

CapturedClip read_captured_clip(const std::string& path, const ReadClipOptions& options,
                                const Common& common) {
  return parse_captured_clip(path, read_bytes(path), options, common);
}

CapturedClip parse_captured_clip(const std::string& path, const std::string& bytes,
                                 const ReadClipOptions& options, const Common& common) {
  io::ClipFile file = parse_any_clip(path, bytes, options, common);
  motion::Capture capture =
      naming(path, [&] { return motion::find_capture(file.clip, read_map(options.map)); });
  return {std::move(file), std::move(capture), {path, base::sha256_hex(bytes)}};
}

void write_bytes(const std::string& path, const std::string& bytes, const Common& common) {
  if (path != "-") return base::write_file(path, bytes, common.writing());
  if (std::fwrite(bytes.data(), 1, bytes.size(), stdout) != bytes.size() ||
      std::fflush(stdout) != 0) {
    throw Error(ErrorKind::kIo, std::string("stdout: cannot be written: ") + std::strerror(errno));
  }
}

std::string check_clip_output(const std::string& path, const WriteClipOptions& options) {
  io::WriteOptions writing;
  if (!options.format.empty()) writing.format = options.format;
  if (path == "-" && options.format.empty()) {
    throw Error(ErrorKind::kUsage, "writing to stdout needs --format");
  }
  const std::string format = io::output_format(path, writing);
  if (format != "glb" && (options.is_compact() || options.no_mesh)) {
    throw Error(ErrorKind::kUsage, "--compact and --no-mesh are for GLB outputs");
  }
  if (format == "glb" && options.up_axis != "y") {
    throw Error(ErrorKind::kUsage, "--up is for BVH outputs; a GLB has +Y up by its specification");
  }
  return format;
}

std::string clip_bytes(const std::string& path, const motion::Clip& clip, const Common& common,
                       const ClipSource& source, const WriteClipOptions& options) {
  const std::string format = check_clip_output(path, options);
  if (format == "glb") {
    io::GlbWriteOptions glb{.bone_mesh = !options.no_mesh};
    if (options.is_compact()) glb.compact.emplace();
    if (options.compact_tolerance_deg) {
      glb.compact->rotation_tolerance_rad = *options.compact_tolerance_deg * math::kDegree;
    }
    if (!source.asset || options.no_mesh) return io::write_glb(clip, glb);
    // Among a character's other animations the new one needs a name of its own.
    if (path != "-") glb.animation_name = fs::path(path).stem().string();
    return io::write_glb(*source.asset, clip, source.source_frames, glb);
  }
  io::WriteOptions writing;
  writing.unit_m = source.unit_m;
  writing.up_axis = *up_axis_named(options.up_axis);
  io::ClipBytes file = io::format_clip(clip, format, writing);
  for (const std::string& rename : file.renames) warn(common, path + ": " + rename);
  return std::move(file.bytes);
}

void write_clip(const std::string& path, const motion::Clip& clip, const Common& common,
                const ClipSource& source, const WriteClipOptions& options) {
  write_bytes(path, clip_bytes(path, clip, common, source, options), common);
}

std::string table_format(const std::string& path, const std::string& format) {
  for (const std::string known : {"csv", "npy"}) {
    if (format == known || (format.empty() && path.ends_with("." + known))) return known;
  }
  return {};
}

void write_table(const std::string& path, const io::MotionTable& table, const Common& common,
                 const std::string& format) {
  const std::string known = table_format(path, format);
  if (known.empty() && path != "-") {
    throw Error(ErrorKind::kUsage, path + ": a table is a .csv or .npy file");
  }
  write_bytes(path, known == "npy" ? io::format_npy(table) : io::format_csv(table), common);
}

void check_outputs(const Common& common, const std::vector<std::string>& paths) {
  for (const std::string& path : paths) {
    if (!path.empty() && path != "-") base::check_writable(path, common.writing());
  }
}

bool is_svg(const std::string& path) {
  if (path.ends_with(".svg")) return true;
  if (path.ends_with(".png")) return false;
  throw Error(ErrorKind::kUsage, path + ": a picture is a .png or .svg file");
}

void add_rater_options(CLI::App* verb, ReadCorpusOptions& options) {
  CLI::Option* one = verb->add_option(
      "--rater", options.rater,
      "the observer whose labels count (default: the mean of all, weighted by confidence)");
  verb->add_flag("--each-rater", options.each_rater,
                 "every observer's label of a blend counts by itself")
      ->excludes(one);
}

double common_rate(const std::vector<double>& rates_hz) {
  std::map<double, int> counts;
  for (const double rate : rates_hz) ++counts[rate];
  const auto rarer = [](const auto& a, const auto& b) {
    return std::pair(a.second, a.first) < std::pair(b.second, b.first);
  };
  return std::max_element(counts.begin(), counts.end(), rarer)->first;
}

LabelledCorpus read_corpus(const std::string& table_path, const ReadCorpusOptions& options,
                           const Common& common) {
  const std::string text = read_bytes(table_path);
  const effort::LabelTable labels =
      chosen_labels(effort::parse_label_table(text, table_path), table_path, options);
  LabelledCorpus read{
      {},
      effort::mean_over_observers(labels),
      {{table_path, base::sha256_hex(text)}},
      {{"labels", options.each_rater ? "each" : "mean"}, {"observers", effort::observers(labels)}}};
  const fs::path folder =
      options.clips.empty() ? fs::path(table_path).parent_path() : fs::path(options.clips);
  const auto at_line = [&](const effort::LabelRow& row, const auto& work) {
    return naming(table_path + ":" + std::to_string(row.line), work);
  };
  ClipCache cache;
  std::vector<double> rates;
  for (const effort::LabelRow& row : effort::seeds(read.table)) {
    if (cache.contains(row.clip)) continue;
    const CapturedClip clip =
        at_line(row, [&] { return read_captured_clip((folder / row.clip).string(), {}, common); });
    rates.push_back(clip.file.clip.frame_rate_hz());
    read.records.push_back(clip.record);
    cache.emplace(row.clip, clip);
  }
  if (rates.empty())
    throw Error(ErrorKind::kData, table_path + ": it has no fragments, only a head or blends");
  const double rate_hz = options.frame_rate_hz.value_or(common_rate(rates));
  IndexOf index;
  for (const effort::LabelRow& row : effort::seeds(read.table)) {
    index.emplace(row.fragment, static_cast<int>(read.corpus.fragments.size()));
    read.corpus.fragments.push_back(
        at_line(row, [&] { return make_fragment(row, cache.at(row.clip), rate_hz); }));
  }
  if (!options.each_rater) {
    add_means(labels, index, read);
  } else if (const int parts = add_observations(labels, index, read); parts > 0) {
    warn(common, fmt::format("{}: --each-rater leaves out {} labels of blends that have not all of "
                             "flow, weight and time",
                             table_path, parts));
  }
  read.corpus.factor_count = factors_of(
      options.each_rater ? effort::mean_over_repeats(labels) : read.table, table_path, common);
  naming(table_path, [&] { read.corpus.check(); });
  return read;
}

std::vector<CutFragment> read_table_fragments(const std::string& table_path, const Common& common) {
  const effort::LabelTable table =
      effort::mean_over_observers(effort::parse_label_table(read_bytes(table_path), table_path));
  const fs::path folder = fs::path(table_path).parent_path();
  const auto at_line = [&](const effort::LabelRow& row, const auto& work) {
    return naming(table_path + ":" + std::to_string(row.line), work);
  };
  ClipCache cache;
  std::vector<double> rates;
  for (const effort::LabelRow& row : effort::seeds(table)) {
    if (cache.contains(row.clip)) continue;
    CapturedClip clip =
        at_line(row, [&] { return read_captured_clip((folder / row.clip).string(), {}, common); });
    rates.push_back(clip.file.clip.frame_rate_hz());
    cache.emplace(row.clip, std::move(clip));
  }
  if (rates.empty()) throw Error(ErrorKind::kData, table_path + ": it has no fragments");
  const double rate_hz = common_rate(rates);
  std::vector<CutFragment> cut;
  for (const effort::LabelRow& row : effort::seeds(table)) {
    cut.push_back(
        {row, at_line(row, [&] { return make_fragment(row, cache.at(row.clip), rate_hz); })});
  }
  return cut;
}

std::optional<fs::path> find_installed(const std::string& name) {
  const fs::path folder = executable_folder();
  for (const fs::path& place : {folder / "../share/laban" / name, folder / name})
    if (fs::exists(place)) return place.lexically_normal();
  return std::nullopt;
}

transfer::StyleModel read_model(const std::string& path, InputRecord& record) {
  std::string found = path;
  if (found.empty()) {
    const auto installed = find_installed("phrase.laban");
    if (!installed) {
      throw Error(ErrorKind::kIo,
                  "the default model is not installed beside the program; "
                  "train one with 'laban train' and name it with --model");
    }
    found = installed->string();
  }
  const std::string bytes = read_bytes(found);
  record = {found, base::sha256_hex(bytes)};
  return transfer::read_style_model(bytes, found);
}

Json run_record(const std::string& verb, const Json& options,
                const std::vector<InputRecord>& inputs) {
  Json record = {
      {"laban", base::version()}, {"verb", verb}, {"options", options}, {"inputs", Json::array()}};
  for (const InputRecord& input : inputs)
    record["inputs"].push_back({{"path", input.path}, {"sha256", input.sha256}});
  if (const char* epoch = std::getenv("SOURCE_DATE_EPOCH")) record["source_date_epoch"] = epoch;
  return record;
}

}  // namespace laban::cli
