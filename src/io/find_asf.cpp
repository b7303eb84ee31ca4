#include "io/find_asf.h"

#include <algorithm>
#include <string>
#include <system_error>
#include <vector>

#include "laban/base/error.h"

#include "io/text_scanner.h"

namespace laban::io {
namespace {

namespace fs = std::filesystem;

/// Sorted, so that the choice does not depend on the file system's order.
std::vector<fs::path> asf_files(const fs::path& folder) {
  std::vector<fs::path> files;
  std::error_code failed;
  for (fs::directory_iterator entry(folder, failed), end; !failed && entry != end;
       entry.increment(failed)) {
    if (equal_but_for_case(entry->path().extension().string(), ".asf")) {
      files.push_back(entry->path());
    }
  }
  std::sort(files.begin(), files.end());
  return files;
}

bool begins_with(const std::string& stem, const std::string& head) {
  return equal_but_for_case(std::string_view(stem).substr(0, head.size()), head);
}

}  // namespace

fs::path find_asf(const fs::path& folder, const fs::path& amc) {
  const fs::path place = folder.empty() ? fs::path(".") : folder;
  const std::vector<fs::path> files = asf_files(place);
  const std::string stem = amc.stem().string();
  const fs::path* best = nullptr;
  for (const fs::path& file : files) {
    const std::string head = file.stem().string();
    if (!begins_with(stem, head)) continue;
    if (best == nullptr || head.size() > best->stem().string().size()) best = &file;
  }
  if (best == nullptr && files.size() == 1) best = &files.front();
  if (best != nullptr) return *best;
  throw base::Error(base::ErrorKind::kIo,
                    amc.string() + ": AMC motion needs its skeleton, but " + place.string() +
                        (files.empty() ? " has no .asf file"
                                       : " has several .asf files and none is named as it begins") +
                        "; name the skeleton (--skeleton FILE.asf)");
}

}  // namespace laban::io
