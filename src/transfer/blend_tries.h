#pragma once

#include <optional>
#include <vector>

#include "laban/effort/observer.h"
#include "laban/transfer/choose_blend.h"
#include "laban/transfer/measured_misses.h"
#include "laban/transfer/play_choice.h"
#include "laban/transfer/style_search.h"

#include "transfer/blend_search.h"

namespace laban::transfer {

/// The blend of a choice as it is played, and what it measures as an action of the fragment's
/// content.
[[nodiscard]] ChosenBlend played(PlayMemory& memory, int fragment, BlendChoice choice,
                                 double fastest_play);

/// The blends that were played and measured for one snippet and target; each try knows what those
/// before it measured (see choose_blend). Only the best is kept as motion, so that long clips take
/// little memory.
class BlendTries {
 public:
  /// Plays the first answer of the search. @param memory  must outlive this.
  /// @throws Error{kUsage} as search_blend.
  BlendTries(PlayMemory& memory, int fragment, const EffortTarget& target,
             const SearchOptions& search, double fastest_play);

  /// Plays and measures the blend that is expected to be best. @returns false, and plays none, if
  /// the best so far misses by less than kMissedBy, none is expected to be better than one that is
  /// known, or the model's labels are not measured.
  bool try_next();
  /// Tells what the best measures where it is joined to other motion. By as much others are taken
  /// to be changed, until they are told of themselves.
  void joined_as(const effort::Effort& measured);

  /// The try that costs least, the first of equals; as joined where that is known.
  [[nodiscard]] std::size_t best_number() const;
  [[nodiscard]] const ChosenBlend& best() const { return best_; }
  [[nodiscard]] int count() const { return static_cast<int>(tried_.size()); }
  /// By how much the target is missed: by its weights, and SearchOptions::stay.
  [[nodiscard]] double cost_of(const effort::Effort& measured) const;

 private:
  struct Tried {
    BlendChoice choice;
    effort::Effort measured;
    std::optional<effort::Effort> joined;
  };
  void play(BlendChoice choice);
  [[nodiscard]] effort::Effort as_joined(const Tried& tried) const;
  [[nodiscard]] double cost_of(const Tried& tried) const { return cost_of(as_joined(tried)); }
  /// What is to be asked of blends by themselves.
  [[nodiscard]] EffortTarget before_joining() const;

  PlayMemory* memory_;
  int fragment_;
  EffortTarget target_;
  SearchOptions options_;
  double fastest_play_;
  BlendCost cost_;
  MeasuredMisses misses_;
  effort::Effort change_;  ///< by joining
  std::vector<Tried> tried_;
  ChosenBlend best_;
  std::size_t best_is_ = 0;  ///< its number
};

}  // namespace laban::transfer
