#pragma once

#include <filesystem>
#include <map>
#include <stdexcept>
#include <string>

#include "laban/base/atomic_file.h"
#include "laban/effort/label_table.h"
#include "laban/io/clip_file.h"
#include "laban/motion/humanoid.h"
#include "laban/motion/retarget.h"
#include "laban/transfer/style_corpus.h"

namespace laban {

/// What regressors learn from a label table whose fragments are whole clips at one frame rate, as
/// `laban corpus --label measured` writes it: one column a blend, three principal components of
/// content.
inline effort::StyleSamples samples_of_table(const std::string& path) {
  const effort::LabelTable table =
      effort::mean_over_observers(effort::parse_label_table(base::read_file(path), path));
  const std::filesystem::path folder = std::filesystem::path(path).parent_path();
  transfer::StyleCorpus corpus;
  std::map<std::string, int> index;
  for (const effort::LabelRow& row : effort::seeds(table)) {
    const io::ClipFile file = io::read_clip(folder / row.clip);
    const motion::Capture capture = motion::find_capture(file.clip);
    motion::Clip clip = capture.clip;
    if (row.begin_frame) {
      const int t_pose = file.clip.frame_count() - clip.frame_count();
      clip = clip.slice(*row.begin_frame - t_pose, *row.end_frame - t_pose);
    }
    index.emplace(row.fragment, static_cast<int>(corpus.fragments.size()));
    corpus.fragments.push_back({row.fragment, row.content, row.performer,
                                motion::to_pose_matrix(clip, capture.humanoid),
                                effort::Effort{*row.flow, *row.weight, *row.time}});
  }
  for (const effort::LabelRow& row : effort::blends(table)) {
    corpus.blends.push_back({row.fragment, index.at(row.parent_i), index.at(row.parent_j),
                             *row.alpha, effort::Effort{*row.flow, *row.weight, *row.time}});
  }
  corpus.check();
  const auto map = transfer::fit_corpus_content_map(corpus.fragments);
  return transfer::style_samples(corpus, transfer::content_coordinates(corpus.fragments, map));
}

}  // namespace laban
