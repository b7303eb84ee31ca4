#pragma once

#include <string>
#include <vector>

#include "styling.h"

namespace laban::cli {

/// Clips to be styled alike into one folder.
struct BatchOptions {
  std::vector<std::string> inputs;  ///< clips, and folders of clips
  std::string folder;               ///< made if it does not exist
  WriteClipOptions writing;
};

/// Name of the table of results in the output folder.
inline constexpr const char* kSummaryName = "summary.csv";

/// Styles every clip, on common.threads threads, and prints what came of each. The table of results
/// in the folder grows with every clip, so a run that was interrupted goes on where it stopped: an
/// output that is there and was made from the same bytes with the same options is left alone.
///
/// @throws Error{kUsage} before any work for outputs of one name, Error{kIo} for one that is there
///         but was made otherwise (without --force); after all work, if a clip failed, an error of
///         the first failure's kind.
void apply_batch(const StylingOptions& styling, const BatchOptions& batch, const Common& common);

}  // namespace laban::cli
