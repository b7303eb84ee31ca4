#pragma once

#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "files.h"
#include "verb.h"

namespace laban::cli {

/// Reads an object of a room's state key by key, and knows which keys nobody asked for. What is
/// wrong is Error{kFormat} in one line that names the file and the key.
class ObjectReader {
 public:
  /// @param json   must outlive this.
  /// @param where  in front of messages: "room.json", "room.json: 'asked'".
  ObjectReader(const Json& json, std::string where);

  [[nodiscard]] const Json& at(const std::string& key);
  /// nullptr if it is missing or null.
  [[nodiscard]] const Json* find(const std::string& key);
  [[nodiscard]] std::string text(const std::string& key);
  /// One of some texts.
  [[nodiscard]] std::string text_of(const std::string& key, const std::vector<std::string>& texts);
  [[nodiscard]] bool flag(const std::string& key);
  [[nodiscard]] double number(const std::string& key);
  [[nodiscard]] double number(const std::string& key, double least, double most);
  [[nodiscard]] int count(const std::string& key);
  [[nodiscard]] int count(const std::string& key, int least, int most);
  [[nodiscard]] double number_in(const Json& value, const std::string& key) const;

  /// @param room  whose state it should be: "the Effort room".
  void require_schema(const std::string& schema, const std::string& room);
  /// @throws for a key that was not read.
  void require_no_more() const;
  [[noreturn]] void fail(const std::string& what) const;
  [[noreturn]] void fail_at(const std::string& key, const std::string& what) const;

 private:
  const Json& json_;
  std::string where_;
  std::set<std::string> known_;
};

/// Adds --state FILE, which stands for every option of the verb but `others`.
/// @param room  whose state it is: "Effort room".
void add_state_option(CLI::App* verb, std::string& path, const std::string& room,
                      const std::vector<CLI::Option*>& others);

/// @throws Error{kFormat} if it is no JSON.
[[nodiscard]] Json parse_state(std::string_view text, const std::string& name);

/// How the clips of a state are read, and back.
[[nodiscard]] Json to_json(const ReadClipOptions& reading);
[[nodiscard]] ReadClipOptions read_reading(const Json& json, const std::string& where);

}  // namespace laban::cli
