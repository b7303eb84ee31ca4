#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "laban/base/error.h"
#include "laban/effort/label_table.h"
#include "laban/io/clip_file.h"
#include "laban/io/motion_table.h"
#include "laban/motion/humanoid.h"
#include "laban/motion/pose_matrix.h"
#include "laban/transfer/style_corpus.h"
#include "laban/transfer/style_model.h"

#include "verb.h"

namespace laban::cli {

using Json = nlohmann::ordered_json;

/// The number, or null where there is none to tell (infinite or not a number).
[[nodiscard]] Json finite_or_null(double value);

/// Runs `work`; an error that does not name the file yet gets its name in front.
template <typename Work>
auto naming(const std::string& path, const Work& work) {
  try {
    return work();
  } catch (const base::Error& error) {
    const std::string what = error.what();
    if (what.starts_with(path)) throw;
    throw base::Error(error.kind(), path + ": " + what);
  }
}

/// A file that was read, for run records.
struct InputRecord {
  std::string path;
  std::string sha256;
};

/// A clip of one person, read, its rig found, cut to its motion.
struct CapturedClip {
  io::ClipFile file;        ///< clip as it stands in the file
  motion::Capture capture;  ///< without a T-pose frame
  InputRecord record;

  /// Frames of the file that come before the motion: 1 if it begins with a T-pose, else 0.
  [[nodiscard]] int first_frame() const {
    return file.clip.frame_count() - capture.clip.frame_count();
  }
  /// At its own rate, or resampled to another one.
  [[nodiscard]] motion::PoseMatrix pose(std::optional<double> frame_rate_hz = std::nullopt) const;
};

/// Options with which every verb that reads clips reads them.
struct ReadClipOptions {
  std::optional<double> unit_m;
  std::optional<double> frame_rate_hz;
  std::string input_format;  ///< needed for "-", stdin
  std::string map;           ///< JSON file: standard joint -> joint name
  std::string up_axis;       ///< "x", "y" or "z"; empty: found from the body
  std::string skeleton;      ///< .asf file of an AMC; empty: found beside it
  std::string animation;     ///< of a glTF file: its name or index; empty: the first
};

/// Adds --unit, --fps, --input-format, --skeleton, --input-up, --map, --animation.
void add_read_options(CLI::App* verb, ReadClipOptions& options);

/// "x", "y" or "z" as an axis, and back. Empty: nullopt.
[[nodiscard]] std::optional<motion::UpAxis> up_axis_named(const std::string& name);
[[nodiscard]] std::string name_of(motion::UpAxis up);

/// How a rig is read, with a map from JSON {"hips": "joint name", ..} if `path` is not empty.
[[nodiscard]] motion::HumanoidOptions read_map(const std::string& path);

/// The clip with the standard joints' names on the joints that play them, for pictures: sides and
/// limbs show on rigs whose own names say nothing.
[[nodiscard]] motion::Clip with_standard_names(const motion::Clip& clip,
                                               const motion::Humanoid& humanoid);

/// Bytes of a file, or of stdin for "-".
[[nodiscard]] std::string read_bytes(const std::string& path);
/// A clip of any rig from bytes that were read from `path`; its warnings go to stderr.
[[nodiscard]] io::ClipFile parse_any_clip(const std::string& path, const std::string& bytes,
                                          const ReadClipOptions& options, const Common& common);
/// Reads a clip of any rig; its warnings go to stderr.
[[nodiscard]] io::ClipFile read_any_clip(const std::string& path, const ReadClipOptions& options,
                                         const Common& common);
/// Reads a clip and finds the person in it. @throws as io and motion::find_capture, naming the
/// file.
[[nodiscard]] CapturedClip read_captured_clip(const std::string& path,
                                              const ReadClipOptions& options, const Common& common);

/// The same from bytes that were read from `path`.
[[nodiscard]] CapturedClip parse_captured_clip(const std::string& path, const std::string& bytes,
                                               const ReadClipOptions& options,
                                               const Common& common);

/// Writes bytes to a path, or to stdout for "-".
void write_bytes(const std::string& path, const std::string& bytes, const Common& common);
/// Options with which every verb that writes clips writes them.
struct WriteClipOptions {
  std::string format;         ///< needed for "-", stdout
  std::string up_axis = "y";  ///< "x", "y" or "z", of a BVH output
  bool no_mesh = false;
  bool compact = false;
  std::optional<double> compact_tolerance_deg;  ///< implies compact

  [[nodiscard]] bool is_compact() const { return compact || compact_tolerance_deg; }
};

/// Adds --format, --up, --no-mesh, --compact, --compact-tolerance.
void add_write_options(CLI::App* verb, WriteClipOptions& options);

/// The format that a clip is to be written in, "bvh" or "glb".
/// @throws Error{kUsage} if it is neither, or an option is for another format.
std::string check_clip_output(const std::string& path, const WriteClipOptions& options);

/// Where a clip comes from, for what of it an output can keep.
struct ClipSource {
  double unit_m = 0.01;  ///< of a BVH output
  /// A glTF file whose character plays the clip; null: none.
  std::shared_ptr<const io::GltfAsset> asset = nullptr;
  /// For each frame of the clip the frame of the asset's clip that shows the same moment; empty:
  /// the same time.
  std::vector<double> source_frames = {};
};

/// The bytes of a clip as the file of that path holds them, in the format of its ending; renamed
/// joints are told as warnings. A GLB of a clip that came from a glTF file is that file with a new
/// animation, named like the path, unless there shall be no mesh.
[[nodiscard]] std::string clip_bytes(const std::string& path, const motion::Clip& clip,
                                     const Common& common, const ClipSource& source = {},
                                     const WriteClipOptions& options = {});
/// Writes them.
void write_clip(const std::string& path, const motion::Clip& clip, const Common& common,
                const ClipSource& source = {}, const WriteClipOptions& options = {});
/// "csv" or "npy" if that is the format given or, without one, the path's ending; else empty.
[[nodiscard]] std::string table_format(const std::string& path, const std::string& format = {});
/// Writes a table in its format. @throws Error{kUsage} if that is neither CSV nor NPY.
void write_table(const std::string& path, const io::MotionTable& table, const Common& common,
                 const std::string& format = {});
/// Throws before any work is done if an output could not be written. Empty paths and "-" pass.
void check_outputs(const Common& common, const std::vector<std::string>& paths);

/// "svg" or "png" picture by the path's ending. @throws Error{kUsage} for another ending.
[[nodiscard]] bool is_svg(const std::string& path);

/// A label table and the captures it names, as a corpus at one frame rate.
struct LabelledCorpus {
  transfer::StyleCorpus corpus;
  effort::LabelTable table;          ///< one row a fragment (mean over observers)
  std::vector<InputRecord> records;  ///< the table, then its clips
  Json raters;                       ///< whose labels these are, for reports and run records
};

struct ReadCorpusOptions {
  std::string clips;  ///< folder that replaces the table's own; empty: the table's
  /// Common rate of the fragments; nullopt: the most frequent one among the clips.
  std::optional<double> frame_rate_hz;
  std::string rater;        ///< the observer whose labels count; empty: the mean of all
  bool each_rater = false;  ///< every observer's label of a blend by itself, not their mean
};

/// A fragment of a table, cut out of its clip.
struct CutFragment {
  effort::LabelRow row;  ///< as it stands in the table
  transfer::Fragment fragment;
};

/// The fragments of a label table, labelled or not, at the most frequent rate of their clips. Each
/// clip is read once. @throws as read_corpus.
[[nodiscard]] std::vector<CutFragment> read_table_fragments(const std::string& table_path,
                                                            const Common& common);

/// Adds --rater and --each-rater.
void add_rater_options(CLI::App* verb, ReadCorpusOptions& options);

/// Reads a label table and every clip it names.
/// @throws naming the table's line for a clip that cannot be read, frames out of range or parents
///         that do not fit; Error{kUsage} if nobody is the observer asked for.
[[nodiscard]] LabelledCorpus read_corpus(const std::string& table_path,
                                         const ReadCorpusOptions& options, const Common& common);

/// The most frequent rate among some, the highest of equals.
[[nodiscard]] double common_rate(const std::vector<double>& rates_hz);

/// A file that comes with the program, beside it or where it is installed; nullopt: it is not
/// there.
[[nodiscard]] std::optional<std::filesystem::path> find_installed(const std::string& name);

/// The model of a path; empty: the default model, found beside the executable.
[[nodiscard]] transfer::StyleModel read_model(const std::string& path, InputRecord& record);

/// What a result file says of the run that made it: version, options as resolved, inputs
/// (STYLE 8); a time only if SOURCE_DATE_EPOCH is set.
[[nodiscard]] Json run_record(const std::string& verb, const Json& options,
                              const std::vector<InputRecord>& inputs);

}  // namespace laban::cli
