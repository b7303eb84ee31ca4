#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace laban::test {

/// What a run of the program left.
struct Outcome {
  int code = -1;
  std::string out;
  std::string err;
};

/// Runs `laban ARGUMENTS` through the shell, in `folder`.
[[nodiscard]] Outcome run_laban(const std::string& arguments, const std::filesystem::path& folder);

/// Runs shell commands in `folder`, in which "$laban" is the program.
[[nodiscard]] Outcome run_shell(const std::string& commands, const std::filesystem::path& folder);

/// An empty folder of this test's own.
[[nodiscard]] std::filesystem::path fresh_folder();

/// Bytes of a file; empty if there is none.
[[nodiscard]] std::string bytes_of(const std::filesystem::path& path);

/// Names of the files in a folder, sorted.
[[nodiscard]] std::vector<std::string> files_in(const std::filesystem::path& folder);

}  // namespace laban::test
