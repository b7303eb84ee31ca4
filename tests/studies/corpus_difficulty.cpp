// Is the embedded corpus no easier than life, and do its performers differ in all three Effort
// factors? DESIGN 8: the ratio of the median DTW cost (raw joint angles, mean of a path cell)
// inside contents to that between contents must be within a factor 1.5 of real captures'. Then,
// for each content: how far the observer's descriptors spread, how they correlate, and the greatest
// ratio of lengths.
//
// Usage: corpus_difficulty_study FOLDER PATTERN CONTENT,CONTENT,..
//   e.g. corpus_difficulty_study data/phrase "phrase_{content}_{performer}"
//   walk,bow,wave,reach,kick

#include <algorithm>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <string>
#include <vector>

#include <Eigen/Dense>

#include "laban/align/content_groups.h"
#include "laban/effort/observer.h"
#include "laban/math/statistics.h"
#include "laban/motion/humanoid.h"
#include "laban/motion/retarget.h"

#include "takes.h"

namespace {

using namespace laban;

struct Take {
  std::string name;
  int content = 0;
  motion::PoseMatrix pose;
};

std::vector<Take> read_takes(const std::filesystem::path& folder, const std::string& pattern,
                             const std::vector<std::string>& contents) {
  std::vector<Take> takes;
  for (const studies::Take& take : studies::read_takes(folder, pattern)) {
    const auto content = std::find(contents.begin(), contents.end(), take.content);
    if (content == contents.end()) continue;
    takes.push_back({take.name, static_cast<int>(content - contents.begin()),
                     motion::to_pose_matrix(take.capture.clip, take.capture.humanoid)});
  }
  return takes;
}

void print_costs(const std::vector<Take>& takes) {
  std::vector<Eigen::MatrixXd> features;
  for (const Take& take : takes) features.push_back(take.pose.angles);
  const Eigen::MatrixXd cost = align::all_pair_costs(features).mean_cost;
  std::vector<double> inside, between;
  for (std::size_t i = 0; i < takes.size(); ++i) {
    for (std::size_t j = 0; j < i; ++j) {
      const bool same = takes[i].content == takes[j].content;
      (same ? inside : between)
          .push_back(cost(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j)));
    }
  }
  const double in = math::median(inside), out = math::median(between);
  std::printf(
      "%zu takes; raw mean path cost, median: inside contents %.3f, between %.3f, ratio %.3f\n",
      takes.size(), in, out, in / out);
}

void print_content(const std::vector<Take>& takes, int content, const std::string& name) {
  std::vector<double> flow, weight, time, frames;
  for (const Take& take : takes) {
    if (take.content != content) continue;
    const effort::Descriptors seen = effort::describe(take.pose);
    flow.push_back(seen.flow);
    weight.push_back(seen.weight);
    time.push_back(seen.time);
    frames.push_back(take.pose.frame_count());
  }
  const auto [shortest, longest] = std::minmax_element(frames.begin(), frames.end());
  std::printf("%-8s %6.2f %6.2f %6.2f   %6.2f %6.2f %6.2f   %5.2f\n", name.c_str(),
              math::standard_deviation(flow), math::standard_deviation(weight),
              math::standard_deviation(time), math::pearson(flow, weight),
              math::pearson(flow, time), math::pearson(weight, time), *longest / *shortest);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 4) {
    std::fprintf(stderr, "usage: corpus_difficulty_study FOLDER PATTERN CONTENT,CONTENT,..\n");
    return 2;
  }
  try {
    const std::vector<std::string> contents = studies::split(argv[3]);
    const std::vector<Take> takes = read_takes(argv[1], argv[2], contents);
    print_costs(takes);
    std::printf("\n         standard deviation      correlation            length\n");
    std::printf("content    flow weight   time      f-w    f-t    w-t   ratio\n");
    for (std::size_t c = 0; c < contents.size(); ++c) {
      print_content(takes, static_cast<int>(c), contents[c]);
    }
  } catch (const std::exception& error) {
    std::fprintf(stderr, "corpus_difficulty_study: %s\n", error.what());
    return 1;
  }
  return 0;
}
