#pragma once

#include <array>
#include <cstddef>
#include <limits>
#include <span>
#include <vector>

#include <Eigen/Dense>

#include "align/lane_frames.h"
#include "align/lane_kernels.h"

namespace laban::align {

/// Leading coordinates in their principal axes that a box bounds on their own; it bounds the others
/// by their norm. Of joint angles 8 hold most of the variance, 21 nearly all.
inline constexpr Eigen::Index kLeadingCoordinates = 21;

/// The cost of what no path has come to.
inline constexpr float kUnreachable = std::numeric_limits<float>::infinity();

/// Boxes that hold a sequence's frames, kBoxFrames each, the last one what is left.
[[nodiscard]] int box_count_for(Eigen::Index frames);

/// The leading coordinates, and below them the norm of the others: a norm's difference is at most
/// the distance of the coordinates, so distances are bounded from below.
[[nodiscard]] Eigen::MatrixXf leading_and_norm(const Eigen::MatrixXf& rotated,
                                               Eigen::Index leading);

/// The boxes of fragments, `lanes` of them side by side as a group.
class FragmentBoxes {
 public:
  /// @param rotated  in principal axes, each D x T_i with one D; those of neighbouring lengths are
  ///                 best neighbours.
  FragmentBoxes(std::span<const Eigen::MatrixXf* const> rotated, const CoarseGrid& grid,
                const LaneKernels& kernels);

 private:
  friend class BoxBounds;
  // Behind a fragment's end its last box is repeated: a path that goes on there costs what it costs
  // to stay.
  struct Group {
    int box_count = 0;  // of the longest
    AlignedArray<int> boxes;
    AlignedArray<int> frames;  // box_count x lanes
  };
  [[nodiscard]] Group group_of(std::span<const Eigen::MatrixXf* const> rotated) const;

  const LaneKernels* kernels_;
  CoarseGrid grid_;
  std::size_t lanes_;
  std::vector<Group> groups_;
  std::vector<Eigen::Index> frames_;  // of each fragment
  int most_boxes_ = 0;
};

/// Lower bounds of what alignments of a query with the fragments of a group cost.
///
/// An alignment of N query frames with M fragment frames has a cell a query frame at least, and
/// each further cell is the first of a fragment frame (and the other way round). So it costs more
/// than `limit` a cell if
///
///   sum over frames p of (d(p, .) - limit) + sum over frames q of min(0, d(., q) - limit) > 0,
///
/// where the first sum is at least the cheapest monotone path's through the boxes. The greater of
/// both ways round counts. The same holds of what is left of a path behind a cell.
class BoxBounds {
 public:
  /// @param fragments  must outlive this.
  /// @param rotated    the query, D x N, in the fragments' axes.
  BoxBounds(const FragmentBoxes& fragments, const Eigen::MatrixXf& rotated);

  /// Until it is called again, all else is about this group.
  void fill(std::size_t group, float limit);
  /// That sum for `fill`'s limit.
  [[nodiscard]] float beyond(std::size_t lane) const { return beyond_[lane]; }

  /// Until it is called again, `rest` is about this lane and limit.
  void fill_rest(std::size_t lane, float limit);
  /// What is left of paths behind the rows of strip n.
  [[nodiscard]] RestOfPath rest(int n) const;

 private:
  // Of each frame of a sequence, over all behind it: sums of least distances less the limit, and of
  // those below 0.
  struct Sums {
    explicit Sums(std::size_t size) : all(size + kBoxFrames), extra(all.size()) {}
    void fill(const float* least, std::size_t lanes, Eigen::Index count, float limit,
              Eigen::Index first);
    std::vector<float> all;
    std::vector<float> extra;
  };

  void fill_beyond(float limit);

  const FragmentBoxes& fragments_;
  std::size_t lanes_;
  std::size_t strip_;  // rows of one
  Eigen::Index rows_;
  Eigen::MatrixXi boxes_;         // of the query
  AlignedArray<int> row_frames_;  // of the query's boxes, the same in all lanes
  std::size_t group_ = 0;
  std::array<float, kMostLanes> beyond_ = {};
  // As LaneKernels names them.
  AlignedArray<float> distances_;
  AlignedArray<float> row_least_;
  AlignedArray<float> box_least_;
  AlignedArray<float> rest_by_rows_;
  AlignedArray<float> path_;
  AlignedArray<float> ends_;
  // Of fill_rest.
  std::size_t lane_ = 0;
  float limit_ = 0.0F;
  Sums row_sums_;  // the last row first
  Sums frame_sums_;
};

}  // namespace laban::align
