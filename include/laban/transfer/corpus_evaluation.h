#pragma once

#include "laban/base/progress.h"
#include "laban/effort/content_map.h"
#include "laban/effort/evaluation.h"
#include "laban/transfer/style_corpus.h"

namespace laban::transfer {

/// The performers or contents of the parents of each blend (effort::leave_one_out_splits).
/// @throws Error{kUsage} for the random protocol, which has none.
[[nodiscard]] effort::ParentGroups parent_groups(const StyleCorpus& corpus,
                                                 effort::Protocol protocol);

/// How well regressors predict the labels of a corpus's blends.
///
/// What a run holds out:
/// - random: the labels of its test blends, no more. As in the paper, fragments and their labels
///   are inputs, known to every run, and the content map is the whole corpus's.
/// - leave-performer-out: every blend with a parent by that performer, and every fragment of
///   theirs: standardization, hyper-parameters, regressors, the content map and the branches of its
///   angles are learnt from the other performers alone. At test time the held-out fragment is known
///   as any input of `apply` is: its motion and its own label.
/// - leave-content-out: the same of one content.
/// Labels are data, as given. Where the kinematic observer measured them, its reference is part of
/// what a label means, the same for training and test.
///
/// @param options  `train` and `test` are for random splits only.
/// @throws Error{kData} if the corpus is not sound or a label is missing; as effort::evaluate and
///         effort::evaluate_leaving_one_out.
[[nodiscard]] effort::EvaluationReport evaluate_corpus(
    const StyleCorpus& corpus, effort::Protocol protocol,
    const effort::EvaluationOptions& options = {}, const effort::ContentMapOptions& content = {},
    base::Progress* progress = nullptr);

}  // namespace laban::transfer
