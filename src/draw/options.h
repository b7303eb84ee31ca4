#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "laban/base/error.h"

#include "draw/canvas.h"

namespace laban::draw {

/// Appends "name = value (must be low .. high)" unless low <= value <= high.
void check_range(std::vector<std::string>& problems, std::string_view name, double value,
                 double low, double high);

/// @throws Error{kUsage} "place: problem" with the first problem, if any.
void throw_first_problem(std::string_view place, const std::vector<std::string>& problems);

}  // namespace laban::draw
