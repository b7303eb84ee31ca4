#pragma once

#include <array>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <Eigen/Dense>

#include "laban/base/container.h"
#include "laban/base/error.h"
#include "laban/motion/clip.h"
#include "laban/motion/foot_contacts.h"
#include "laban/motion/humanoid.h"

namespace laban::motion {

/// The body that a learnt model plays its motion on.
struct StoredRig {
  Clip stance;                     ///< one frame: what no pose says stays as here
  Humanoid humanoid;               ///< fits `stance`
  std::optional<FootFloor> floor;  ///< of the captures; nullopt if no foot ever stands
};

/// A matrix as an array of a container.
[[nodiscard]] base::Array to_array(const Eigen::Ref<const Eigen::MatrixXd>& matrix);
/// Whole numbers as an array of one row.
[[nodiscard]] base::Array to_array(const std::vector<int>& values);

/// Reads the parts of one learnt model's file; a rule that a part breaks is told as "name: what;
/// mend". Refers to what it is made of.
class PartReader {
 public:
  /// What no number of a model may exceed: metres, radians, their squares, map units. Far above any
  /// body, far below what overflows.
  static constexpr double kMaxValue = 1e9;

  /// @param mend  such as "learn the texture again".
  PartReader(const base::Container& container, std::string_view name, std::string_view mend)
      : container_(container), name_(name), mend_(mend) {}

  /// @throws Error{kFormat} "name: what; mend" unless it holds.
  void require(bool holds, const std::string& what) const;
  /// The values of an array, at most kMaxValue in size; a size of -1 may be any.
  /// @throws Error{kFormat}, as all below, if it is not there or not so.
  [[nodiscard]] Eigen::MatrixXd matrix(const std::string& array, Eigen::Index rows,
                                       Eigen::Index cols) const;
  /// Whole numbers of an array of one row, in [low, high]; a count of -1 may be any.
  [[nodiscard]] std::vector<int> whole(const std::string& array, Eigen::Index count, double low,
                                       double high) const;
  /// Each in [low, high] and whole. @param what  is told else.
  [[nodiscard]] std::vector<int> whole(const Eigen::Ref<const Eigen::RowVectorXd>& values,
                                       double low, double high, const std::string& what) const;
  /// w, x, y, z of length 1.
  [[nodiscard]] Eigen::Quaterniond rotation(const Eigen::Vector4d& wxyz) const;
  /// A leg's length in metres, above 0.
  [[nodiscard]] double leg_length(double metres) const;
  /// A frame rate in hertz, above 0 and at most 1e6.
  [[nodiscard]] double frame_rate(double hz) const;

  [[nodiscard]] const std::string& header_json() const noexcept { return container_.header_json; }

 private:
  const base::Container& container_;
  std::string_view name_;
  std::string_view mend_;
};

/// What a file's header says of its rig; all else is in arrays "rig.*".
struct StoredRigHeader {
  std::vector<std::string> joints;  ///< their names, parents first
  std::string name;                 ///< of the rig table
  double leg_length_m = 0.0;
  bool animates_translations = false;
  std::optional<std::array<double, 2>> floor_m;  ///< heel, toe
};

/// Puts a rig into a container's arrays "rig.*". @returns what its header has to say.
[[nodiscard]] StoredRigHeader save_rig(const StoredRig& rig, base::Container& container);
/// The rig of a container. @throws Error{kFormat} for one that is not sound.
[[nodiscard]] StoredRig load_rig(const PartReader& reader, const StoredRigHeader& header,
                                 double rate_hz);

// A header is JSON of nlohmann's kind, which public headers do not name: `Json` is that type.

/// As save_rig, the header's keys "joints" and "rig" included.
template <typename Json>
void save_rig(const StoredRig& rig, base::Container& container, Json& header) {
  const StoredRigHeader facts = save_rig(rig, container);
  header["joints"] = facts.joints;
  header["rig"]["name"] = facts.name;
  header["rig"]["leg_length_m"] = facts.leg_length_m;
  header["rig"]["animates_translations"] = facts.animates_translations;
  if (facts.floor_m) header["rig"]["floor_m"] = *facts.floor_m;
}

/// As load_rig, out of the header's keys "joints" and "rig".
template <typename Json>
[[nodiscard]] StoredRig load_rig(const PartReader& reader, const Json& header, double rate_hz) {
  const Json& rig = header.at("rig");
  StoredRigHeader facts;
  header.at("joints").get_to(facts.joints);
  rig.at("name").get_to(facts.name);
  rig.at("leg_length_m").get_to(facts.leg_length_m);
  rig.at("animates_translations").get_to(facts.animates_translations);
  if (rig.contains("floor_m")) {
    facts.floor_m.emplace();
    rig.at("floor_m").get_to(*facts.floor_m);
  }
  return load_rig(reader, facts, rate_hz);
}

/// The header, refused before it is kept if it is nested too deep or has too many keys.
template <typename Json>
[[nodiscard]] Json parse_header(const PartReader& reader) {
  constexpr int kMaxDepth = 64;
  constexpr std::size_t kMaxKeys = std::size_t{1} << 20U;
  std::size_t keys = 0;
  bool bounded = true;
  const auto mind = [&](int depth, typename Json::parse_event_t event, Json& /*parsed*/) {
    if (event == Json::parse_event_t::key) ++keys;
    bounded = bounded && depth <= kMaxDepth && keys <= kMaxKeys;
    return bounded;
  };
  Json header = Json::parse(reader.header_json(), mind);
  reader.require(bounded, "its header is nested too deep or has too many keys");
  reader.require(header.is_object(), "its header is no object");
  return header;
}

/// What `read(reader)` makes of a container; whatever it throws is told as the reader tells it.
/// @throws Error{kFormat} "name: what; mend".
template <typename Json, typename Read>
[[nodiscard]] auto read_parts(const base::Container& container, std::string_view name,
                              std::string_view mend, const Read& read) {
  const auto told = [&](const std::string& what) {
    return base::Error(base::ErrorKind::kFormat,
                       std::string(name) + ": " + what + "; " + std::string(mend));
  };
  try {
    return read(PartReader(container, name, mend));
  } catch (const typename Json::exception& error) {
    throw told(std::string("its header is malformed (") + error.what() + ")");
  } catch (const base::Error& error) {
    // A part that is not sound does not know of which file it is.
    if (std::string_view(error.what()).starts_with(std::string(name) + ": ")) throw;
    throw told(error.what());
  }
}

}  // namespace laban::motion
