#include "laban/draw/contact_sheet.h"

#include <cmath>
#include <numeric>

#include "draw/figure.h"
#include "draw/options.h"
#include "draw/strip_motion.h"

namespace laban::draw {
namespace {

// Units on the page.
constexpr double kMargin = 24.0;
constexpr double kTitleLine = 34.0;
constexpr double kStripLine = 26.0;
constexpr double kTimeLine = 18.0;
constexpr double kFooterLine = 22.0;
constexpr double kStripGap = 20.0;
constexpr double kPanelGap = 18.0;     // between a row and its trail panel below it
constexpr double kSideGap = 22.0;      // between a row and its trail panel beside it
constexpr double kHighestRow = 190.0;  // a figure's height at most
constexpr double kTitleSize = 17.0;
constexpr double kStripSize = 13.0;
constexpr double kLabelSize = 11.0;

// Where the trails of the whole clip are drawn.
enum class TrailPanel { kNone, kBeside, kBelow };

struct Layout {
  TrailPanel panel = TrailPanel::kNone;
  double cell = 0.0;         // width of a cell, units
  double scale = 0.0;        // of the poses, units a metre
  double panel_scale = 0.0;  // of the trail panel or the panorama
  double side_width = 0.0;   // of the panel beside, units
  Extent row;                // vertical extent of every pose, metres
};

std::vector<double> times_of(std::span<const Strip> strips, int pose_count) {
  double longest_s = 0.0;
  int most_frames = 1;
  for (const Strip& strip : strips) {
    longest_s = std::max(longest_s, strip.clip.duration_s());
    most_frames = std::max(most_frames, strip.clip.frame_count());
  }
  const int count = longest_s > 0.0 ? std::min(pose_count, most_frames) : 1;
  std::vector<double> times;
  for (int i = 0; i < count; ++i) times.push_back(count == 1 ? 0.0 : longest_s * i / (count - 1));
  return times;
}

// Width of a cell in metres: neighbours may overlap in the widest tenth of the cases, where the
// rest would otherwise become small.
double cell_need(const std::vector<StripMotion>& motions) {
  std::vector<double> needs;
  for (const StripMotion& motion : motions) {
    std::vector<Extent> extents;
    for (std::size_t i = 0; i < motion.poses.size(); ++i) {
      extents.push_back(pose_extent(motion, i, motion.camera));
    }
    needs.push_back(extents.front().width());
    for (std::size_t i = 1; i < extents.size(); ++i) {
      needs.push_back(extents[i - 1].right - extents[i].left);
    }
  }
  const auto rank = static_cast<std::ptrdiff_t>(0.9 * static_cast<double>(needs.size() - 1));
  std::nth_element(needs.begin(), needs.begin() + rank, needs.end());
  constexpr double kAir = 1.08;
  return kAir * needs[static_cast<std::size_t>(rank)];
}

// Furthest that the outer poses reach out of the row, metres from their cells' middles.
double end_reach(const std::vector<StripMotion>& motions) {
  double reach = 0.0;
  for (const StripMotion& motion : motions) {
    const std::size_t last = motion.poses.size() - 1;
    reach = std::max({reach, -pose_extent(motion, 0, motion.camera).left,
                      pose_extent(motion, last, motion.camera).right});
  }
  return reach;
}

Extent row_extent(const std::vector<StripMotion>& motions) {
  Extent all;
  for (const StripMotion& motion : motions) {
    for (std::size_t i = 0; i < motion.poses.size(); ++i) {
      all.include(pose_extent(motion, i, motion.camera));
    }
  }
  return all;
}

Extent widest_travel(const std::vector<StripMotion>& motions, bool with_tracks) {
  Extent all = travel_extent(motions.front(), with_tracks);
  for (const StripMotion& motion : motions) {
    const Extent one = travel_extent(motion, with_tracks);
    all = {0.0, std::max(all.width(), one.width()), std::min(all.bottom, one.bottom),
           std::max(all.top, one.top)};
  }
  return all;
}

Layout spread_layout(const std::vector<StripMotion>& motions, std::size_t cells,
                     const ContactSheetOptions& options) {
  Layout layout;
  const double width = options.width - 2.0 * kMargin;
  const double need = cell_need(motions);
  const auto count = static_cast<double>(cells);
  layout.row = row_extent(motions);
  layout.scale = kHighestRow / layout.row.height();
  const double travel = widest_travel(motions, true).width();
  if (options.trajectories) {
    // Beside the row the panel may take up to two sevenths of the width, or what is free.
    const bool fits = (count * need + travel) * layout.scale <= width - kSideGap;
    const bool narrow = fits || travel <= 0.4 * count * need;
    layout.panel = narrow ? TrailPanel::kBeside : TrailPanel::kBelow;
  }
  const bool beside = layout.panel == TrailPanel::kBeside;
  const double row = beside ? width - kSideGap : width;
  layout.scale = std::min(layout.scale, row / (count * need + (beside ? travel : 0.0)));
  // The outer poses may reach into the margins, not beyond.
  const double cell = (row - (beside ? travel * layout.scale : 0.0)) / count;
  layout.scale = std::min(layout.scale, (0.5 * cell + 0.8 * kMargin) / end_reach(motions));
  layout.side_width = beside ? travel * layout.scale : 0.0;
  layout.cell = (row - layout.side_width) / count;
  layout.panel_scale = layout.scale;
  if (layout.panel == TrailPanel::kBelow) {
    layout.panel_scale = std::min(layout.scale, width / travel);
    // One scale for all is easier to read, where it costs little.
    if (layout.panel_scale > 0.8 * layout.scale) layout.scale = layout.panel_scale;
  }
  return layout;
}

Layout panorama_layout(const std::vector<StripMotion>& motions,
                       const ContactSheetOptions& options) {
  Layout layout;
  layout.row = widest_travel(motions, options.trajectories);
  const double width = options.width - 2.0 * kMargin;
  layout.panel_scale = std::min(kHighestRow / layout.row.height(), width / layout.row.width());
  layout.scale = layout.panel_scale;
  return layout;
}

// Points of a trail; those too near to the last to be told from it are left out.
std::vector<Point> thinned(const std::vector<Point>& points) {
  constexpr double kNearest = 0.4;
  std::vector<Point> kept;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const bool last = i + 1 == points.size();
    if (kept.empty() || last || (points[i] - kept.back()).norm() >= kNearest) {
      kept.push_back(points[i]);
    }
  }
  return kept;
}

// A curve that gains color toward its end.
void draw_fading(Canvas& canvas, const std::vector<Point>& points, const Color& color,
                 double faintest, double width) {
  constexpr std::size_t kMostPieces = 16;
  const std::vector<Point> kept = thinned(points);
  if (kept.size() < 2) return;
  const std::size_t steps = kept.size() - 1;
  const std::size_t pieces = std::min(kMostPieces, steps);
  for (std::size_t p = 0; p < pieces; ++p) {
    const std::size_t begin = p * steps / pieces;
    const std::size_t end = (p + 1) * steps / pieces;
    const double strength =
        faintest + (1.0 - faintest) * (static_cast<double>(p) + 1.0) / static_cast<double>(pieces);
    canvas.polyline(std::span(kept).subspan(begin, end - begin + 1),
                    {.color = mix(kWhite, color, strength), .width = width});
  }
}

// Trails of the step of time before pose `index`, in the space that moves with the body.
void draw_step_trails(Canvas& canvas, const StripMotion& motion, std::size_t index,
                      const Placing& placing) {
  if (index == 0) return;
  canvas.begin_group("trail");
  for (std::size_t t = 0; t < motion.tracks.size(); ++t) {
    std::vector<Point> points;
    for (int f = motion.frames[index - 1]; f <= motion.frames[index]; ++f) {
      const Eigen::Vector3d p = motion.tracks[t].col(f) - motion.anchor(f);
      points.push_back(placing(motion.camera.right.dot(p), motion.camera.up.dot(p)));
    }
    const Color color = mix(kWhite, side_color(motion.body.tracers[t].side), 0.75);
    draw_fading(canvas, points, color, 0.1, 1.2);
  }
  canvas.end_group();
}

// Trails of the whole clip in true space; the anchor of frame 0 is at the placing's origin.
void draw_travel_trails(Canvas& canvas, const StripMotion& motion, const Placing& placing) {
  canvas.begin_group("trail");
  for (std::size_t t = 0; t < motion.tracks.size(); ++t) {
    const Eigen::Matrix3Xd flat =
        motion.travel_camera.project(motion.tracks[t].colwise() - motion.anchor(0));
    std::vector<Point> points;
    for (Eigen::Index f = 0; f < flat.cols(); ++f) {
      points.push_back(placing(flat(0, f), flat(1, f)));
    }
    draw_fading(canvas, points, side_color(motion.body.tracers[t].side), 0.3, 1.3);
  }
  canvas.end_group();
}

// Where pose `index` stands in true space.
Placing travel_placing(const StripMotion& motion, std::size_t index, const Placing& placing) {
  const Eigen::Vector3d from_start = motion.anchor(motion.frames[index]) - motion.anchor(0);
  const Camera& camera = motion.travel_camera;
  return {placing(camera.right.dot(from_start), camera.up.dot(from_start)), placing.scale};
}

void draw_travel_pose(Canvas& canvas, const StripMotion& motion, std::size_t index,
                      const Placing& placing, Ink ink) {
  draw_figure(canvas, motion.body, motion.poses[index], motion.anchor(motion.frames[index]),
              motion.travel_camera, travel_placing(motion, index, placing), ink);
}

// Ghosts that stand far enough from each other to be read; the first always.
std::vector<std::size_t> ghosts_apart(const StripMotion& motion, const Placing& placing) {
  std::vector<std::size_t> chosen = {0};
  const double apart = 0.45 * motion.body.size_m * placing.scale;
  for (std::size_t i = 1; i < motion.poses.size(); ++i) {
    const Point here = travel_placing(motion, i, placing).origin;
    const bool free = std::all_of(chosen.begin(), chosen.end(), [&](std::size_t c) {
      return (here - travel_placing(motion, c, placing).origin).norm() >= apart;
    });
    if (free) chosen.push_back(i);
  }
  return chosen;
}

void draw_floor(Canvas& canvas, double left, double right, double y) {
  canvas.line({left, y}, {right, y}, {.color = kHairline, .width = 1.0});
}

void draw_scale_bar(Canvas& canvas, double right, double y, double scale, std::string_view what) {
  double metres = 1.0;
  while (metres * scale > 160.0) metres /= 10.0;
  while (metres * scale < 16.0) metres *= 10.0;
  const double left = right - metres * scale;
  const Stroke stroke{.color = kSoftInk, .width = 1.0};
  canvas.line({left, y}, {right, y}, stroke);
  canvas.line({left, y - 2.5}, {left, y + 2.5}, stroke);
  canvas.line({right, y - 2.5}, {right, y + 2.5}, stroke);
  canvas.text({left - 6.0, y + 3.5}, std::string(what).append(short_number(metres, 6)).append(" m"),
              {.size = kLabelSize, .anchor = Anchor::kEnd});
}

std::string time_label(double time_s, double longest_s) {
  return fixed_number(time_s, longest_s < 100.0 ? 2 : 1) + " s";
}

// A sheet being drawn: what does not change from strip to strip.
struct Sheet {
  const std::vector<StripMotion>& motions;
  const std::vector<double>& times;
  const ContactSheetOptions& options;
  Layout layout;

  [[nodiscard]] bool spread() const { return options.placement == Placement::kSpread; }
  [[nodiscard]] double left() const { return kMargin; }
  [[nodiscard]] double right() const { return options.width - kMargin; }
};

bool has_title(const Strip& strip) {
  return !strip.title.empty() || !strip.note.empty();
}

double panel_height(const Sheet& sheet, const StripMotion& motion) {
  return travel_extent(motion, true).height() * sheet.layout.panel_scale;
}

double strip_height(const Sheet& sheet, const StripMotion& motion) {
  double height = has_title(*motion.strip) ? kStripLine : 0.0;
  if (!sheet.spread()) return height + panel_height(sheet, motion) + kTimeLine;
  height += sheet.layout.row.height() * sheet.layout.scale + kTimeLine;
  if (sheet.layout.panel == TrailPanel::kBelow) height += kPanelGap + panel_height(sheet, motion);
  return height;
}

double sheet_height(const Sheet& sheet) {
  double height = 2.0 * kMargin + kFooterLine - kLabelSize;
  if (!sheet.options.title.empty()) height += kTitleLine;
  for (const StripMotion& motion : sheet.motions) height += strip_height(sheet, motion) + kStripGap;
  return height;
}

void draw_strip_title(Canvas& canvas, const Sheet& sheet, const Strip& strip, double y) {
  const double width = sheet.right() - sheet.left();
  const std::string note = fit_text(strip.note, kLabelSize, false, 0.5 * width);
  const double left_over = width - text_width(note, kLabelSize) - kMargin;
  canvas.text({sheet.left(), y + kStripSize}, fit_text(strip.title, kStripSize, true, left_over),
              {.size = kStripSize, .color = kInk, .bold = true});
  if (note.empty()) return;
  canvas.text({sheet.right(), y + kStripSize}, note, {.size = kLabelSize, .anchor = Anchor::kEnd});
}

// Times at the cells' middles; every second, third, .. where they would touch.
void draw_time_labels(Canvas& canvas, const Sheet& sheet, const StripMotion& motion, double floor_y,
                      double label_y) {
  const double longest = sheet.times.back();
  const double room = text_width(time_label(longest, longest), kLabelSize) + 8.0;
  const auto every = static_cast<std::size_t>(std::ceil(room / sheet.layout.cell));
  for (std::size_t i = 0; i < motion.poses.size(); ++i) {
    const double x = sheet.left() + sheet.layout.cell * (static_cast<double>(i) + 0.5);
    canvas.line({x, floor_y}, {x, floor_y + 4.0}, {.color = kHairline});
    if (i % every != 0) continue;
    canvas.text({x, label_y}, time_label(sheet.times[i], longest),
                {.size = kLabelSize, .anchor = Anchor::kMiddle});
  }
}

void draw_marks(Canvas& canvas, const Sheet& sheet, const StripMotion& motion, double top,
                double bottom) {
  const double step = sheet.times.size() > 1 ? sheet.times[1] : 1.0;
  for (const double mark : motion.strip->marks_s) {
    if (!(mark >= 0.0 && mark <= motion.strip->clip.duration_s())) continue;
    const double x = sheet.left() + sheet.layout.cell * (mark / step + 0.5);
    canvas.line({x, top}, {x, bottom}, {.color = kSoftInk, .width = 0.9, .dashed = true});
  }
}

void draw_row(Canvas& canvas, const Sheet& sheet, const StripMotion& motion, double y) {
  const Layout& layout = sheet.layout;
  const double floor_y = y + layout.row.top * layout.scale;
  const double bottom = y + layout.row.height() * layout.scale;
  const double end = sheet.left() + layout.cell * static_cast<double>(sheet.times.size());
  draw_floor(canvas, sheet.left(), end, floor_y);
  draw_marks(canvas, sheet, motion, y, bottom + 2.0);
  draw_time_labels(canvas, sheet, motion, floor_y, bottom + kLabelSize + 3.0);
  for (std::size_t i = 0; i < motion.poses.size(); ++i) {
    const double x = sheet.left() + layout.cell * (static_cast<double>(i) + 0.5);
    const Placing placing{{x, floor_y}, layout.scale};
    if (sheet.options.trajectories) draw_step_trails(canvas, motion, i, placing);
    draw_figure(canvas, motion.body, motion.poses[i], motion.anchor(motion.frames[i]),
                motion.camera, placing, Ink::kColored);
  }
}

// The trails of the whole clip in true space, in the middle of `left` .. `right`.
void draw_trail_panel(Canvas& canvas, const Sheet& sheet, const StripMotion& motion, double left,
                      double right, double floor_y) {
  const Extent extent = travel_extent(motion, true);
  const double scale = sheet.layout.panel_scale;
  const double middle = 0.5 * (left + right) - 0.5 * scale * (extent.left + extent.right);
  const Placing placing{{middle, floor_y}, scale};
  for (const std::size_t i : ghosts_apart(motion, placing)) {
    draw_travel_pose(canvas, motion, i, placing, Ink::kGhost);
  }
  draw_floor(canvas, left, right, floor_y);
  draw_travel_trails(canvas, motion, placing);
}

void draw_spread(Canvas& canvas, const Sheet& sheet, const StripMotion& motion, double y) {
  const Layout& layout = sheet.layout;
  draw_row(canvas, sheet, motion, y);
  if (layout.panel == TrailPanel::kBeside) {
    draw_trail_panel(canvas, sheet, motion, sheet.right() - layout.side_width, sheet.right(),
                     y + layout.row.top * layout.scale);
  }
  if (layout.panel != TrailPanel::kBelow) return;
  const double top = y + layout.row.height() * layout.scale + kTimeLine + kPanelGap;
  draw_trail_panel(canvas, sheet, motion, sheet.left(), sheet.right(),
                   top + travel_extent(motion, true).top * layout.panel_scale);
}

void draw_panorama(Canvas& canvas, const Sheet& sheet, const StripMotion& motion, double y) {
  const Extent extent = travel_extent(motion, true);
  const double scale = sheet.layout.panel_scale;
  const double floor_y = y + extent.top * scale;
  const double middle =
      0.5 * (sheet.left() + sheet.right()) - 0.5 * scale * (extent.left + extent.right);
  const Placing placing{{middle, floor_y}, scale};
  draw_floor(canvas, sheet.left(), sheet.right(), floor_y);
  if (sheet.options.trajectories) draw_travel_trails(canvas, motion, placing);
  const double longest = sheet.times.back();
  const double room = text_width(time_label(longest, longest), kLabelSize) + 8.0;
  std::vector<double> labeled;
  for (std::size_t i = 0; i < motion.poses.size(); ++i) {
    draw_travel_pose(canvas, motion, i, placing, Ink::kColored);
    const double x = travel_placing(motion, i, placing).origin.x();
    const bool free = std::none_of(labeled.begin(), labeled.end(),
                                   [&](double other) { return std::abs(x - other) < room; });
    if (!free) continue;
    labeled.push_back(x);
    canvas.text({x, y + extent.height() * scale + kLabelSize + 3.0},
                time_label(sheet.times[i], longest),
                {.size = kLabelSize, .anchor = Anchor::kMiddle});
  }
}

// What the colors mean, and the scale.
void draw_footer(Canvas& canvas, const Sheet& sheet, double y) {
  double x = sheet.left();
  const auto entry = [&](Side side, std::string_view name) {
    canvas.capsule({x + 3.0, y - 3.8}, 3.0, {x + 15.0, y - 3.8}, 3.0, side_color(side));
    canvas.text({x + 24.0, y}, name, {.size = kLabelSize});
    x += 24.0 + text_width(name, kLabelSize) + 18.0;
  };
  entry(Side::kLeft, "left");
  entry(Side::kRight, "right");
  const Layout& layout = sheet.layout;
  const bool one_scale = layout.panel_scale == layout.scale;
  draw_scale_bar(canvas, sheet.right(), y - 3.5, layout.panel_scale, one_scale ? "" : "trails: ");
}

void draw_sheet(Canvas& canvas, const Sheet& sheet, double height) {
  double y = kMargin;
  if (!sheet.options.title.empty()) {
    canvas.text({sheet.left(), y + kTitleSize - 2.0},
                fit_text(sheet.options.title, kTitleSize, true, sheet.right() - sheet.left()),
                {.size = kTitleSize, .color = kInk, .bold = true});
    y += kTitleLine;
  }
  for (const StripMotion& motion : sheet.motions) {
    const double below = y + strip_height(sheet, motion) + kStripGap;
    canvas.begin_group("strip");
    if (has_title(*motion.strip)) {
      draw_strip_title(canvas, sheet, *motion.strip, y);
      y += kStripLine;
    }
    if (sheet.spread()) {
      draw_spread(canvas, sheet, motion, y);
    } else {
      draw_panorama(canvas, sheet, motion, y);
    }
    canvas.end_group();
    y = below;
  }
  draw_footer(canvas, sheet, height - kMargin);
}

}  // namespace

std::vector<std::string> ContactSheetOptions::problems() const {
  std::vector<std::string> found;
  check_range(found, "ContactSheetOptions::pose_count", pose_count, 1.0, 200.0);
  check_range(found, "ContactSheetOptions::width", width, 200.0, 10000.0);
  check_range(found, "ContactSheetOptions::pixel_ratio", pixel_ratio, 0.25, 8.0);
  return found;
}

std::vector<double> contact_sheet_times(std::span<const Strip> strips, int pose_count) {
  if (strips.empty()) {
    throw base::Error(base::ErrorKind::kUsage, "contact_sheet: no strip (give at least one clip)");
  }
  if (pose_count < 1) {
    throw base::Error(
        base::ErrorKind::kUsage,
        "contact_sheet: pose_count = " + std::to_string(pose_count) + " (must be at least 1)");
  }
  return times_of(strips, pose_count);
}

std::string contact_sheet(std::span<const Strip> strips, const ContactSheetOptions& options) {
  throw_first_problem("contact_sheet", options.problems());
  const std::vector<double> times = contact_sheet_times(strips, options.pose_count);
  std::vector<StripMotion> motions;
  for (std::size_t i = 0; i < strips.size(); ++i) {
    motions.push_back(describe_strip(strips[i], i, times, options.view));
  }
  const bool spread = options.placement == Placement::kSpread;
  const Sheet sheet{
      motions, times, options,
      spread ? spread_layout(motions, times.size(), options) : panorama_layout(motions, options)};
  const double height = sheet_height(sheet);
  const auto canvas =
      make_canvas(options.format, options.width, height, options.pixel_ratio, "contact_sheet");
  draw_sheet(*canvas, sheet, height);
  return canvas->finish();
}

}  // namespace laban::draw
