#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <new>
#include <system_error>

#include <fcntl.h>
#include <fmt/core.h>
#include <unistd.h>

#include "laban/base/atomic_file.h"
#include "laban/base/error.h"
#include "laban/base/version.h"

#include "verb.h"

namespace laban::cli {
namespace {

constexpr const char* kExamples =
    "  laban apply walk.bvh --flow -2 --weight 1.5 --time 2 -o walk_sudden.glb\n"
    "  laban train --labels labels/phrase.csv -o phrase.laban\n"
    "  laban evaluate --labels labels/phrase.csv --runs 500\n";

constexpr const char* kExitCodes =
    "Exit codes:\n"
    "  0 done  1 bug in laban  2 usage  3 file not read or written  4 malformed file\n"
    "  5 data unfit for the method  6 numerical failure  7 a check found something\n"
    "  130 interrupted\n\n"
    "'laban help VERB' tells more of one verb.";

class ProgramFormatter : public CLI::Formatter {
 public:
  std::string make_description(const CLI::App* app) const override {
    return kExamples + ("\n" + app->get_description()) + ".\n";
  }
  std::string make_usage(const CLI::App* /*app*/, std::string /*name*/) const override {
    return "Usage: laban VERB [options] INPUT... -o OUTPUT\n";
  }
};

/// Help of a verb and of its parts (`laban manifold learn`), which are verbs below it.
std::string help_of(const CLI::App& verb, const std::string& before) {
  std::string text = verb.help(before);
  for (const CLI::App* part : verb.get_subcommands([](const CLI::App*) { return true; })) {
    text += "\n" + part->help(before + " " + verb.get_name());
  }
  return text;
}

/// The one place where an error becomes an exit code.
int exit_code(base::ErrorKind kind) {
  switch (kind) {
    case base::ErrorKind::kUsage:
      return 2;
    case base::ErrorKind::kIo:
      return 3;
    case base::ErrorKind::kFormat:
      return 4;
    case base::ErrorKind::kData:
      return 5;
    case base::ErrorKind::kNumeric:
      return 6;
    case base::ErrorKind::kInternal:
      return 1;
  }
  return 1;
}

/// Ends the program as the shell's users know it, 130 for an interrupt, without a file left aside.
void end_at_signal(int signal) {
  base::remove_unfinished_files();
  std::_Exit(128 + signal);
}

void set_up_process() {
  for (const int signal : {SIGINT, SIGTERM, SIGHUP}) std::signal(signal, end_at_signal);
  // A file beyond the limit on its size (ulimit -f) is an error to report, not a reason to die.
  std::signal(SIGXFSZ, SIG_IGN);
  // A closed stdin, stdout or stderr would give its number to the next file that is opened, and
  // what is printed would end up in there.
  for (const int fd : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO}) {
    // Read-only: to write there still fails.
    if (::fcntl(fd, F_GETFD) < 0) static_cast<void>(::open("/dev/null", O_RDONLY));
  }
}

int run(int argc, char** argv) {
  CLI::App app("laban keeps what a motion does and changes how it is done", "laban");
  app.formatter(std::make_shared<ProgramFormatter>());
  app.footer(kExitCodes);
  app.set_version_flag("--version", "laban " + std::string(base::version()));
  app.require_subcommand(1);
  add_apply(app);
  add_train(app);
  add_evaluate(app);
  add_agree(app);
  add_corpus(app);
  add_suggest(app);
  add_match(app);
  add_segment(app);
  add_blend(app);
  add_curve(app);
  add_measure(app);
  add_inspect(app);
  add_convert(app);
  add_draw(app);
  add_loop(app);
  add_manifold(app);
  add_texture(app);
#ifdef LABAN_HAS_STUDIO
  add_studio(app);
#endif

  std::string topic;
  CLI::App* help =
      add_verb(app, "help", "Tell of a verb, its options and an example", "laban help apply");
  help->add_option("VERB", topic, "the verb");

  const auto failed = [&app](const std::string& what, int code) {
    const auto verbs = app.get_subcommands();
    fmt::print(stderr, "laban{}: {}\n", verbs.empty() ? "" : " " + verbs.front()->get_name(), what);
    return code;
  };
  try {
    app.parse(argc, argv);
    if (help->parsed()) {
      fmt::print("{}", topic.empty() ? app.help() : help_of(*app.get_subcommand(topic), "laban"));
    }
    return 0;
  } catch (const CLI::CallForHelp&) {
    const auto verbs = app.get_subcommands();
    if (verbs.empty()) {
      fmt::print("{}", app.help());
      return 0;
    }
    const auto parts = verbs.front()->get_subcommands();
    fmt::print("{}", parts.empty() ? help_of(*verbs.front(), "laban")
                                   : parts.front()->help("laban " + verbs.front()->get_name()));
    return 0;
  } catch (const CLI::CallForVersion&) {
    fmt::print("laban {}\n", base::version());
    return 0;
  } catch (const CLI::OptionNotFound&) {
    return failed("there is no verb '" + topic + "'; 'laban --help' lists them", 2);
  } catch (const CLI::ParseError& error) {
    const auto verbs = app.get_subcommands();
    const std::string mend =
        verbs.empty() ? "'laban --help' lists the verbs"
                      : "'laban help " + verbs.front()->get_name() + "' lists the options";
    return failed(std::string(error.what()) + "; " + mend, 2);
  } catch (const CheckFailed&) {
    return 7;
  } catch (const base::Error& error) {
    return failed(error.what(), exit_code(error.kind()));
  } catch (const std::bad_alloc&) {
    return failed("out of memory; try a shorter clip or a smaller database", 6);
  } catch (const std::exception& error) {
    if (std::ferror(stdout) != 0) throw;  // fmt::print
    return failed(std::string("bug in laban: ") + error.what(), 1);
  }
}

/// run(), and an error if what it has printed does not arrive.
int run_and_flush(int argc, char** argv) {
  int code = 0;
  try {
    code = run(argc, argv);
  } catch (const std::system_error& error) {
    errno = error.code().value();
  }
  const bool arrived = std::fflush(stdout) == 0 && std::ferror(stdout) == 0;
  if (arrived || code != 0) return code;
  fmt::print(stderr, "laban: stdout: cannot be written: {}\n", std::strerror(errno));
  return 3;
}

}  // namespace
}  // namespace laban::cli

int main(int argc, char** argv) {
  laban::cli::set_up_process();
  return laban::cli::run_and_flush(argc, argv);
}
