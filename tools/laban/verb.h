#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include <CLI/CLI.hpp>

#include "laban/base/atomic_file.h"
#include "laban/base/progress.h"

namespace laban::cli {

/// All cores of this machine.
[[nodiscard]] int default_threads();

/// What means the same for every verb (STYLE 11).
struct Common {
  bool quiet = false;
  bool verbose = false;
  bool json = false;
  bool force = false;
  int threads = default_threads();  ///< all cores unless told
  std::uint64_t seed = 1;           ///< of everything random

  [[nodiscard]] base::WriteFileOptions writing() const { return {.overwrite = force}; }
};

/// Which of the common options a verb takes beside -q and -v.
struct CommonOptions {
  bool json = true;
  bool writes = false;   ///< --force
  bool threads = false;  ///< --threads
  bool seed = false;     ///< --seed
};

/// Adds a verb: `summary` is its line in `laban --help`, `example` opens its own help.
CLI::App* add_verb(CLI::App& app, const std::string& name, const std::string& summary,
                   const std::string& example);

/// Adds the common options to a verb.
void add_common(CLI::App* verb, Common& common, const CommonOptions& which = {});

/// Thrown once all is printed by a verb that was asked to check and found something: exit code 7.
struct CheckFailed {};

/// Messages, all on stderr; the result alone goes to stdout.
void warn(const Common& common, const std::string& message);
/// A decision taken, under -v only.
void tell(const Common& common, const std::string& message);

/// A progress line on stderr: only on a terminal, after half a second, never under -q.
[[nodiscard]] std::unique_ptr<base::Progress> terminal_progress(const Common& common,
                                                                std::string what);

/// The verbs, a file each.
void add_agree(CLI::App& app);
void add_apply(CLI::App& app);
void add_blend(CLI::App& app);
void add_convert(CLI::App& app);
void add_corpus(CLI::App& app);
void add_curve(CLI::App& app);
void add_draw(CLI::App& app);
void add_evaluate(CLI::App& app);
void add_inspect(CLI::App& app);
void add_loop(CLI::App& app);
void add_manifold(CLI::App& app);
void add_match(CLI::App& app);
void add_measure(CLI::App& app);
void add_segment(CLI::App& app);
void add_studio(CLI::App& app);  ///< in tools/studio; not in every build
void add_suggest(CLI::App& app);
void add_texture(CLI::App& app);
void add_train(CLI::App& app);

}  // namespace laban::cli
