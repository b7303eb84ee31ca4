#include "verb.h"

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <thread>

#include <fmt/core.h>
#include <unistd.h>

namespace laban::cli {
namespace {

/// Help of a verb: the example, then what CLI11 makes of the options.
class VerbFormatter : public CLI::Formatter {
 public:
  explicit VerbFormatter(std::string example) : example_(std::move(example)) { column_width(34); }
  std::string make_description(const CLI::App* app) const override {
    return "Example:\n  " + example_ + "\n\n" + app->get_description() + ".\n";
  }

 private:
  std::string example_;
};

class TerminalProgress : public base::Progress {
 public:
  TerminalProgress(std::string what, bool shown) : what_(std::move(what)), shown_(shown) {}
  TerminalProgress(const TerminalProgress&) = delete;
  TerminalProgress& operator=(const TerminalProgress&) = delete;
  ~TerminalProgress() override {
    if (drawn_) std::fputs("\r\033[K", stderr);
  }
  bool update(double fraction) override {
    using std::chrono::duration;
    const double elapsed_s = duration<double>(Clock::now() - begin_).count();
    if (!shown_ || elapsed_s < 0.5 || elapsed_s - last_s_ < 0.1) return true;
    last_s_ = elapsed_s;
    drawn_ = true;
    const double left_s = fraction > 0.0 ? elapsed_s * (1.0 - fraction) / fraction : 0.0;
    fmt::print(stderr, "\r{} {:3.0f} %, about {:.0f} s left\033[K", what_, 100.0 * fraction,
               left_s);
    return true;
  }

 private:
  using Clock = std::chrono::steady_clock;
  std::string what_;
  bool shown_;
  bool drawn_ = false;
  double last_s_ = 0.0;
  Clock::time_point begin_ = Clock::now();
};

}  // namespace

int default_threads() {
  return std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
}

CLI::App* add_verb(CLI::App& app, const std::string& name, const std::string& summary,
                   const std::string& example) {
  CLI::App* verb = app.add_subcommand(name, summary);
  verb->formatter(std::make_shared<VerbFormatter>(example));
  return verb;
}

void add_common(CLI::App* verb, Common& common, const CommonOptions& which) {
  const std::string group = "Common options";
  verb->add_flag("-q,--quiet", common.quiet, "errors only")->group(group);
  verb->add_flag("-v,--verbose", common.verbose, "also the decisions taken")->group(group);
  if (which.json) verb->add_flag("--json", common.json, "print one JSON object")->group(group);
  if (which.writes) {
    verb->add_flag("--force", common.force, "overwrite files that exist")->group(group);
  }
  if (which.threads) {
    verb->add_option("--threads", common.threads, "threads; the result does not depend on it")
        ->check(CLI::Range(1, 1024))
        ->group(group);
  }
  if (which.seed) {
    verb->add_option("--seed", common.seed, "of everything random")
        ->capture_default_str()
        ->group(group);
  }
}

void warn(const Common& common, const std::string& message) {
  if (!common.quiet) fmt::print(stderr, "laban: warning: {}\n", message);
}

void tell(const Common& common, const std::string& message) {
  if (common.verbose && !common.quiet) fmt::print(stderr, "laban: {}\n", message);
}

std::unique_ptr<base::Progress> terminal_progress(const Common& common, std::string what) {
  return std::make_unique<TerminalProgress>(std::move(what),
                                            !common.quiet && ::isatty(STDERR_FILENO) != 0);
}

}  // namespace laban::cli
