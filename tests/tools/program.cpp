#include "program.h"

#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <iterator>

#include <gtest/gtest.h>
#include <sys/wait.h>

namespace laban::test {

namespace fs = std::filesystem;

std::string bytes_of(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), std::istreambuf_iterator<char>()};
}

fs::path fresh_folder() {
  const auto* test = ::testing::UnitTest::GetInstance()->current_test_info();
  const fs::path folder = fs::path(LABAN_BINARY_DIR) / "cli_tests" /
                          (std::string(test->test_suite_name()) + "_" + test->name());
  fs::remove_all(folder);
  fs::create_directories(folder);
  return folder;
}

std::vector<std::string> files_in(const fs::path& folder) {
  std::vector<std::string> names;
  for (const auto& entry : fs::directory_iterator(folder))
    names.push_back(entry.path().filename().string());
  std::sort(names.begin(), names.end());
  return names;
}

Outcome run_shell(const std::string& commands, const fs::path& folder) {
  const fs::path logs = folder.string() + ".log";
  fs::create_directories(logs);
  const std::string command = "cd '" + folder.string() + "' && laban='" LABAN_PROGRAM "' && { " +
                              commands + "\n} >'" + (logs / "out").string() + "' 2>'" +
                              (logs / "err").string() + "'";
  const int status = std::system(command.c_str());
  return {WIFEXITED(status) ? WEXITSTATUS(status) : -1, bytes_of(logs / "out"),
          bytes_of(logs / "err")};
}

Outcome run_laban(const std::string& arguments, const fs::path& folder) {
  return run_shell("\"$laban\" " + arguments, folder);
}

}  // namespace laban::test
