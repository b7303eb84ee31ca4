#include <cstdio>
#include <cstdlib>

#include <fmt/core.h>
#include <spawn.h>
#include <sys/wait.h>

#include "laban/base/error.h"

#include "server.h"
#include "studio.h"
#include "verb.h"

extern char** environ;

namespace laban::cli {
namespace {

struct StudioVerb {
  Common common;
  studio::StudioOptions studio;
  unsigned short port = 0;
  bool no_browser = false;
};

/// Opens the address where the desktop opens addresses; without a desktop the printed one has to
/// do.
void open_browser(const std::string& url, const Common& common) {
  if (std::getenv("DISPLAY") == nullptr && std::getenv("WAYLAND_DISPLAY") == nullptr) return;
  std::string program = "xdg-open";
  std::string address = url;
  char* arguments[] = {program.data(), address.data(), nullptr};
  pid_t child = 0;
  if (::posix_spawnp(&child, program.c_str(), nullptr, nullptr, arguments, environ) != 0)
    warn(common, "no browser could be opened (xdg-open); open the address by hand");
}

std::string read_page() {
  const auto path = find_installed("studio/index.html");
  if (!path) {
    throw base::Error(base::ErrorKind::kIo,
                      "the studio's pages are not installed beside the program; build it with npm "
                      "installed, or install it whole");
  }
  return read_bytes(path->string());
}

/// Who is at the machine.
std::string user_name() {
  const char* user = std::getenv("USER");
  return user == nullptr || *user == '\0' ? "rater" : user;
}

void run(StudioVerb& verb) {
  verb.studio.labelling.seed = verb.common.seed;
  if (verb.studio.labelling.observer.empty()) verb.studio.labelling.observer = user_name();
  studio::Studio rooms(verb.studio, read_page(), verb.common);
  studio::ServerOptions options;
  options.port = verb.port;
  studio::Server server(
      options, studio::Access(studio::random_hex(16)),
      [&](const studio::Request& request) { return rooms.handle(request); },
      [&](const studio::Request& request) { return rooms.handle_at_once(request); });
  fmt::print("{}\n", server.url());
  std::fflush(stdout);
  if (!verb.no_browser) open_browser(server.url(), verb.common);
  server.run();
}

}  // namespace

void add_studio(CLI::App& app) {
  auto verb = std::make_shared<StudioVerb>();
  CLI::App* sub = add_verb(app, "studio", "See and steer motion in a browser on this machine",
                           "laban studio walk.bvh --model bandai.laban");
  sub->add_option("INPUT", verb->studio.clips, "clips to open; more can be dropped on the page");
  sub->add_option("--model", verb->studio.model, "style model (default: the embedded corpus's)");
  sub->add_option("--texture", verb->studio.texture, "motion texture (.texture): opens its room");
  sub->add_option("--manifold", verb->studio.manifold, "map of poses (.manifold): opens its room");
  const std::string group = "Labelling";
  sub->add_option("--label", verb->studio.labelling.table,
                  "label table to fill in by watching: opens the labelling room instead")
      ->group(group);
  sub->add_option("--observer", verb->studio.labelling.observer, "who rates")
      ->default_str("your user name")
      ->group(group);
  sub->add_option("--repeats", verb->studio.labelling.repeats,
                  "share that is shown a second time, unannounced")
      ->check(CLI::Range(0.0, 1.0))
      ->capture_default_str()
      ->group(group);
  sub->add_flag("--suggested", verb->studio.labelling.suggested,
                "blends after all fragments, in the order of 'laban suggest'")
      ->group(group);
  sub->add_flag("--space", verb->studio.labelling.space, "rate Space too")->group(group);
  sub->add_option("--port", verb->port, "of 127.0.0.1 to listen on; 0: one that is free")
      ->capture_default_str();
  sub->add_flag("--no-browser", verb->no_browser, "print the address alone");
  add_read_options(sub, verb->studio.reading);
  add_common(sub, verb->common, {.json = false, .seed = true});
  sub->callback([verb] { run(*verb); });
}

}  // namespace laban::cli
