#include <algorithm>
#include <filesystem>
#include <map>
#include <set>

#include <fmt/core.h>

#include "laban/base/error.h"

#include "files.h"
#include "suggested_blends.h"
#include "verb.h"

namespace laban::cli {
namespace {

namespace fs = std::filesystem;
using base::Error;
using base::ErrorKind;

struct SuggestVerb {
  Common common;
  std::string labels;
  std::string clips;
  std::string output;
  int count = 20;
  std::optional<int> pool;
  int components = 3;
};

/// Blends drawn as `laban corpus` draws them, of names that the table has not.
std::vector<transfer::CorpusBlend> draw_pool(const SuggestVerb& verb, const LabelledCorpus& read) {
  std::set<std::string> taken;
  for (const effort::LabelRow& row : read.table.rows) taken.insert(row.fragment);
  auto drawn =
      transfer::draw_blends(read.corpus.fragments, {.count = *verb.pool, .seed = verb.common.seed});
  int number = 0;
  for (transfer::CorpusBlend& blend : drawn) {
    do {
      blend.name = fmt::format("suggested_{:03}", ++number);
    } while (taken.contains(blend.name));
  }
  return drawn;
}

/// Blends without a label whose parents have one: the table's own, or drawn ones.
std::vector<transfer::CorpusBlend> pool_of(const SuggestVerb& verb, const LabelledCorpus& read) {
  std::vector<transfer::CorpusBlend> pool;
  if (verb.pool) {
    pool = draw_pool(verb, read);
  } else {
    std::copy_if(read.corpus.blends.begin(), read.corpus.blends.end(), std::back_inserter(pool),
                 [](const transfer::CorpusBlend& blend) { return !blend.effort; });
  }
  const std::size_t all = pool.size();
  std::erase_if(pool, [&](const auto& blend) { return !has_labelled_parents(read.corpus, blend); });
  if (pool.size() < all) {
    warn(verb.common, fmt::format("{}: {} of {} blends are left out, a parent of theirs has no "
                                  "label yet; label the fragments first",
                                  verb.labels, all - pool.size(), all));
  }
  if (pool.empty()) {
    throw Error(ErrorKind::kData,
                verb.labels +
                    ": there is no blend to choose from, with blank labels and labelled parents; "
                    "draw some with --pool 400, or label the fragments first");
  }
  return pool;
}

/// The table to fill in: fragments and labelled blends, then the suggested ones, blank, in order.
effort::LabelTable table_of(const SuggestVerb& verb, const LabelledCorpus& read,
                            const std::vector<SuggestedBlend>& choices) {
  const fs::path from =
      verb.clips.empty() ? fs::path(verb.labels).parent_path() : fs::path(verb.clips);
  const fs::path to = verb.output == "-" ? fs::path() : fs::path(verb.output).parent_path();
  const fs::path folder = (fs::current_path() / to / "").lexically_normal();
  const auto moved = [&](const std::string& clip) {
    if (clip.empty()) return clip;
    return (fs::current_path() / from / clip)
        .lexically_normal()
        .lexically_relative(folder)
        .generic_string();
  };
  effort::LabelTable table;
  std::map<std::string, effort::LabelRow> blank;
  for (effort::LabelRow row : read.table.rows) {
    row.clip = moved(row.clip);
    if (row.is_blend() && !row.is_rated()) {
      blank.emplace(row.fragment, row);
    } else {
      table.rows.push_back(row);
    }
  }
  for (const SuggestedBlend& choice : choices) {
    effort::LabelRow row;
    if (const auto found = blank.find(choice.blend.name); found != blank.end()) row = found->second;
    const auto parent = [&](int fragment) {
      return read.corpus.fragments[static_cast<std::size_t>(fragment)];
    };
    row.fragment = choice.blend.name;
    row.content = parent(choice.blend.fragment_i).content;
    row.parent_i = parent(choice.blend.fragment_i).name;
    row.parent_j = parent(choice.blend.fragment_j).name;
    row.alpha = choice.blend.alpha;
    table.rows.push_back(row);
  }
  return table;
}

void print(const SuggestVerb& verb, const LabelledCorpus& read,
           const std::vector<SuggestedBlend>& choices) {
  const auto name = [&](int fragment) {
    return read.corpus.fragments[static_cast<std::size_t>(fragment)].name;
  };
  if (verb.common.json) {
    Json json = {{"schema", "laban.suggest/1"},
                 {"table", verb.output.empty() ? Json() : Json(verb.output)},
                 {"suggestions", Json::array()}};
    for (const SuggestedBlend& choice : choices) {
      json["suggestions"].push_back({{"fragment", choice.blend.name},
                                     {"parent_i", name(choice.blend.fragment_i)},
                                     {"parent_j", name(choice.blend.fragment_j)},
                                     {"alpha", choice.blend.alpha},
                                     {"expected_drop", choice.expected_drop}});
    }
    json["run"] = run_record("suggest",
                             {{"seed", verb.common.seed},
                              {"count", verb.count},
                              {"pool", verb.pool ? Json(*verb.pool) : Json()},
                              {"components", verb.components}},
                             read.records);
    fmt::print("{}\n", json.dump(2));
    return;
  }
  fmt::print("{:>4}  {:<20}{:>8}{:>8}  parents\n", "", "blend", "alpha", "drop");
  double sum = 0.0;
  for (std::size_t n = 0; n < choices.size(); ++n) {
    const transfer::CorpusBlend& blend = choices[n].blend;
    sum += choices[n].expected_drop;
    fmt::print("{:>4}  {:<20}{:>8.3f}{:>6.1f} %  {} {}\n", n + 1, blend.name, blend.alpha,
               100.0 * choices[n].expected_drop, name(blend.fragment_i), name(blend.fragment_j));
  }
  fmt::print("all together: {:.1f} % of the predictive variance over the pool\n", 100.0 * sum);
}

void run(const SuggestVerb& verb) {
  check_outputs(verb.common, {verb.output});
  if (verb.output == "-" && verb.common.json) {
    throw Error(ErrorKind::kUsage, "--json and -o - would both write to stdout; name a file");
  }
  ReadCorpusOptions reading;
  reading.clips = verb.clips;
  const LabelledCorpus read = read_corpus(verb.labels, reading, verb.common);
  const std::vector<SuggestedBlend> choices =
      suggested_blends(read.corpus, pool_of(verb, read), verb.count, verb.components);
  if (!verb.output.empty()) {
    write_bytes(verb.output, effort::format_label_table(table_of(verb, read, choices)),
                verb.common);
  }
  if (verb.output != "-") print(verb, read, choices);
}

}  // namespace

void add_suggest(CLI::App& app) {
  auto verb = std::make_shared<SuggestVerb>();
  CLI::App* sub = add_verb(app, "suggest", "Tell which blends a rater should label next",
                           "laban suggest --labels partial.csv --count 20 -o next.csv");
  sub->add_option("--labels", verb->labels,
                  "label table (CSV): labelled blends are known, blank ones to choose from")
      ->required();
  sub->add_option("--clips", verb->clips, "folder of the clips (default: the table's own)");
  sub->add_option("--count", verb->count, "blends to suggest")
      ->check(CLI::Range(1, 100000))
      ->capture_default_str();
  sub->add_option("--pool", verb->pool,
                  "choose from so many blends drawn anew (400, say) instead of the table's")
      ->check(CLI::Range(1, 5000));
  sub->add_option("--components", verb->components, "principal components of content")
      ->check(CLI::Range(1, 20))
      ->capture_default_str();
  sub->add_option("-o,--output", verb->output,
                  "label table to write (CSV), the suggested blends last, blank");
  add_common(sub, verb->common, {.writes = true, .seed = true});
  sub->callback([verb] { run(*verb); });
}

}  // namespace laban::cli
