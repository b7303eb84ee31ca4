#pragma once

#include <string>

#include "laban/texture/learn_texture.h"
#include "laban/texture/motion_texture.h"

#include "files.h"
#include "verb.h"

namespace laban::cli {

/// The parts of `laban texture`, a file each.
void add_texture_learn(CLI::App* texture);
void add_texture_inspect(CLI::App* texture);
void add_texture_fragments(CLI::App* texture);

/// Reads a `.texture` file. @throws naming it.
[[nodiscard]] texture::MotionTexture read_texture_file(const std::string& path,
                                                       InputRecord& record);

/// What is in a texture, as JSON of `laban inspect` and as lines of text (`each`: a line a texton).
[[nodiscard]] Json describe_texture(const texture::MotionTexture& texture);
[[nodiscard]] std::string texture_text(const texture::MotionTexture& texture, bool each);

/// How a texture was learnt, as part of its run record, and back.
[[nodiscard]] Json to_json(const texture::LearningReport& report);
/// @throws Error{kFormat} if the record is not one of learning.
[[nodiscard]] texture::LearningReport learning_report(const std::string& record_json,
                                                      const std::string& path);

/// Transition matrix, lengths of segments, log-likelihood of each round and the starts compared:
/// one picture.
[[nodiscard]] std::string texture_picture(const texture::MotionTexture& texture,
                                          const texture::LearningReport& report,
                                          const std::string& title, bool svg);

}  // namespace laban::cli
