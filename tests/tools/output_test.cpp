// What is left of outputs when things go wrong: the old file whole or the new one whole, and
// nothing else. Real processes, killed, interrupted and short of room.

#include <chrono>
#include <csignal>
#include <fstream>
#include <thread>

#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include "laban/base/rng.h"

#include "program.h"

namespace laban::test {
namespace {

namespace fs = std::filesystem;
using namespace std::chrono_literals;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

const std::string kTake = LABAN_SOURCE_DIR "/data/take.bvh";
const std::string kOld = "the old file\n";

void write(const fs::path& path, const std::string& bytes) {
  std::ofstream(path, std::ios::binary) << bytes;
}

class Output : public ::testing::Test {
 protected:
  Output() : folder_(fresh_folder()) {}

  [[nodiscard]] Outcome shell(const std::string& commands) const {
    return run_shell(commands, folder_);
  }
  /// Expects exit code 3 and one line on stderr that has all these parts.
  static void expect_one_line(const Outcome& result, const std::vector<std::string>& parts) {
    EXPECT_EQ(result.code, 3) << result.err;
    for (const std::string& part : parts) EXPECT_THAT(result.err, HasSubstr(part));
    EXPECT_EQ(std::count(result.err.begin(), result.err.end(), '\n'), 1) << result.err;
  }
  /// Runs commands below a new mount of a tmpfs of 256 kB at ./small; nullopt where that is not
  /// permitted.
  [[nodiscard]] std::optional<Outcome> shell_with_small_disk(const std::string& commands) const {
    fs::create_directories(folder_ / "small");
    const std::string mount = "mount -t tmpfs -o size=256k tmpfs small";
    if (shell("unshare -m sh -c '" + mount + "'").code != 0) return std::nullopt;
    return shell("export laban; unshare -m sh -c '" + mount + " && " + commands + "'");
  }

  /// Starts `laban ARGUMENTS` in the folder, silently.
  [[nodiscard]] pid_t start(const std::vector<std::string>& arguments) const {
    const pid_t child = ::fork();
    if (child != 0) return child;
    std::vector<char*> words = {const_cast<char*>(LABAN_PROGRAM)};
    for (const std::string& argument : arguments) {
      words.push_back(const_cast<char*>(argument.c_str()));
    }
    words.push_back(nullptr);
    const int null = ::open("/dev/null", O_RDWR);
    if (::chdir(folder_.c_str()) != 0 || ::dup2(null, 1) < 0 || ::dup2(null, 2) < 0) ::_exit(99);
    ::execv(LABAN_PROGRAM, words.data());
    ::_exit(99);
  }
  [[nodiscard]] static int wait_for(pid_t child) {
    int status = 0;
    EXPECT_EQ(::waitpid(child, &status, 0), child);
    return status;
  }
  /// Waits until a file aside appears or the process ends; false if it has ended.
  [[nodiscard]] bool wait_for_aside(pid_t child) const {
    for (;;) {
      for (const std::string& name : files_in(folder_)) {
        if (name.find(".part-") != name.npos) return true;
      }
      siginfo_t ended{};
      if (::waitid(P_PID, static_cast<id_t>(child), &ended, WEXITED | WNOHANG | WNOWAIT) != 0 ||
          ended.si_pid == child) {
        return false;
      }
    }
  }
  /// A conversion whose output is some 10 MB: long enough to be hit while it is written.
  const std::vector<std::string> kLong = {"convert", kTake,     "--rate",  "2400",
                                          "-o",      "out.bvh", "--force", "-q"};

  fs::path folder_;
};

TEST_F(Output, IsTheOldFileOrTheNewOneWhenKilledAtAnyMoment) {
  const auto began = std::chrono::steady_clock::now();
  ASSERT_EQ(wait_for(start(kLong)), 0);
  const auto duration = std::chrono::steady_clock::now() - began;
  const std::string whole = bytes_of(folder_ / "out.bvh");
  ASSERT_GT(whole.size(), 5'000'000U);
  base::Rng rng(1);
  int killed_in_write = 0;
  for (int trial = 0; trial < 24; ++trial) {
    SCOPED_TRACE(trial);
    write(folder_ / "out.bvh", kOld);
    const pid_t child = start(kLong);
    // Every other time at any moment, else as soon as the output is begun and a little later.
    if (trial % 2 == 0) {
      std::this_thread::sleep_for(duration * rng.uniform(0.0, 1.1));
    } else if (wait_for_aside(child)) {
      ++killed_in_write;
      std::this_thread::sleep_for(rng.uniform(0.0, 20.0) * 1ms);
    }
    ::kill(child, SIGKILL);
    static_cast<void>(wait_for(child));
    const std::string left = bytes_of(folder_ / "out.bvh");
    EXPECT_TRUE(left == kOld || left == whole) << left.size() << " bytes";
    for (const std::string& name : files_in(folder_)) {
      if (name == "out.bvh") continue;
      EXPECT_EQ(name.find("out.bvh.part-"), 0U) << name;  // a user can tell what it was
      fs::remove(folder_ / name);
    }
  }
  EXPECT_GT(killed_in_write, 3);
}

TEST_F(Output, LeavesNothingAsideWhenInterrupted) {
  for (const int signal : {SIGINT, SIGTERM, SIGHUP}) {
    SCOPED_TRACE(signal);
    bool interrupted = false;
    for (int trial = 0; trial < 10 && !interrupted; ++trial) {
      write(folder_ / "out.bvh", kOld);
      const pid_t child = start(kLong);
      static_cast<void>(wait_for_aside(child));
      ::kill(child, signal);
      const int status = wait_for(child);
      EXPECT_THAT(files_in(folder_), ElementsAre("out.bvh"));
      interrupted = WIFEXITED(status) && WEXITSTATUS(status) == 128 + signal;
    }
    EXPECT_TRUE(interrupted);
  }
}

TEST_F(Output, IsTheOldFileWhenItGrowsBeyondTheLimit) {
  write(folder_ / "out.bvh", kOld);
  const Outcome result =
      shell("ulimit -f 16; \"$laban\" convert " + kTake + " --rate 240 -o out.bvh --force");
  expect_one_line(result, {"out.bvh: cannot be written: File too large"});
  EXPECT_EQ(bytes_of(folder_ / "out.bvh"), kOld);
  EXPECT_THAT(files_in(folder_), ElementsAre("out.bvh"));
}

TEST_F(Output, OfSeveralFilesEachIsOldOrNew) {
  for (const char* name : {"out.bvh", "report.json"}) write(folder_ / name, kOld);
  const Outcome result =
      shell("ulimit -f 16; \"$laban\" apply " + kTake +
            " --time 1 -o out.bvh --report report.json --picture out.png --force");
  EXPECT_EQ(result.code, 3) << result.err;
  EXPECT_THAT(result.err, HasSubstr("cannot be written: File too large"));
  EXPECT_EQ(bytes_of(folder_ / "out.bvh"), kOld);
  for (const std::string& name : files_in(folder_)) {
    EXPECT_EQ(name.find(".part-"), name.npos) << name;
  }
  const std::string report = bytes_of(folder_ / "report.json");
  EXPECT_TRUE(report == kOld || report.ends_with("}\n") || report.ends_with("}")) << report;
}

TEST_F(Output, IsTheOldFileWhenTheDiskIsFull) {
  const auto result = shell_with_small_disk(
      "echo the old file > small/out.bvh; \"$laban\" convert " + kTake +
      " --rate 240 -o small/out.bvh --force; code=$?; cat small/out.bvh; ls -A small; exit $code");
  if (!result) GTEST_SKIP() << "no small disk to fill: mounting a tmpfs is not permitted here";
  expect_one_line(*result, {"small/out.bvh: cannot be written: No space left on device"});
  EXPECT_EQ(result->out, kOld + "out.bvh\n");
}

TEST_F(Output, IsToldBeforeTheWorkWhenTheFolderIsReadOnly) {
  const auto result = shell_with_small_disk(
      "echo the old file > small/out.bvh; mount -o remount,ro small; \"$laban\" convert " + kTake +
      " -o small/out.bvh --force; code=$?; cat small/out.bvh; ls -A small; exit $code");
  if (!result) GTEST_SKIP() << "no read-only folder: mounting a tmpfs is not permitted here";
  expect_one_line(*result, {"small/out.bvh: cannot be written: the folder small is not writable"});
  EXPECT_EQ(result->out, kOld + "out.bvh\n");
}

TEST_F(Output, IsToldBeforeTheWorkWhenThePathLeadsThroughAFile) {
  write(folder_ / "file", kOld);
  expect_one_line(shell("\"$laban\" convert " + kTake + " -o file/out.bvh"),
                  {"file/out.bvh: cannot be written: the folder file does not exist"});
  EXPECT_EQ(bytes_of(folder_ / "file"), kOld);
}

TEST_F(Output, FollowsALinkAndKeepsItAndThePermissions) {
  fs::create_directories(folder_ / "takes");
  write(folder_ / "takes" / "real.bvh", kOld);
  fs::permissions(folder_ / "takes" / "real.bvh", fs::perms::owner_read | fs::perms::owner_write);
  fs::create_symlink("takes/real.bvh", folder_ / "out.bvh");
  const std::string convert = "\"$laban\" convert " + kTake + " -o out.bvh";
  expect_one_line(shell(convert), {"exists already; give --force to overwrite it"});
  EXPECT_EQ(shell(convert + " --force").code, 0);
  EXPECT_TRUE(fs::is_symlink(folder_ / "out.bvh"));
  EXPECT_EQ(bytes_of(folder_ / "takes" / "real.bvh").substr(0, 9), "HIERARCHY");
  EXPECT_EQ(fs::status(folder_ / "takes" / "real.bvh").permissions(),
            fs::perms::owner_read | fs::perms::owner_write);
  EXPECT_THAT(files_in(folder_ / "takes"), ElementsAre("real.bvh"));
}

TEST_F(Output, GoesIntoDevicesAndPipesAndLeavesThemInPlace) {
  const std::string convert = "\"$laban\" convert " + kTake + " --format bvh -o ";
  EXPECT_EQ(shell(convert + "/dev/null").code, 0);
  EXPECT_EQ(shell(convert + "/dev/null --force").code, 0);
  EXPECT_TRUE(fs::is_character_file("/dev/null"));
  expect_one_line(shell(convert + "/dev/full --force"),
                  {"/dev/full: cannot be written: No space left on device"});
  EXPECT_TRUE(fs::is_character_file("/dev/full"));
  const Outcome piped = shell("mkfifo pipe; cat pipe & " + convert + "pipe; wait");
  EXPECT_EQ(piped.out.substr(0, 9), "HIERARCHY");
  EXPECT_EQ(shell(convert + "/dev/stdout -q | cat").out.substr(0, 9), "HIERARCHY");
}

TEST_F(Output, ToAStdoutThatIsFullOrClosedIsAnError) {
  const std::string convert = "\"$laban\" convert " + kTake;
  const std::string full = "stdout: cannot be written: No space left on device";
  expect_one_line(shell(convert + " --format bvh -o - >/dev/full"), {full});
  expect_one_line(shell("\"$laban\" inspect " + kTake + " >/dev/full"), {full});
  expect_one_line(shell("\"$laban\" --help >/dev/full"), {full});
  expect_one_line(shell(convert + " --format bvh -o - >&-"), {"stdout: cannot be written: "});
  // What is printed must not end up in the file that takes the closed stdout's number.
  expect_one_line(shell(convert + " -o out.bvh >&-"), {"stdout: cannot be written: "});
  EXPECT_EQ(shell(convert + " -o again.bvh").code, 0);
  EXPECT_EQ(bytes_of(folder_ / "out.bvh"), bytes_of(folder_ / "again.bvh"));
}

}  // namespace
}  // namespace laban::test
