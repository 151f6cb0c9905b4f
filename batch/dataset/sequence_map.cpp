#include "batch/dataset/sequence_map.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <utility>

#include "batch/dataset/plot_style.h"
#include "geo/units.h"
#include "tiler/map_drawing.h"

namespace terracast::batch {

namespace {

using tiler::Canvas;
using tiler::Colour;

constexpr std::size_t kMostPanels = 12;
constexpr double kMetresPerDegree =
    111195.0;              // of a sphere as large as the Earth: a picture's accuracy
constexpr int kScale = 2;  ///< of letters
constexpr int kLine_px = 11 * kScale;
constexpr int kLegend_px = 2 * kLine_px;
constexpr double kLeastSpan_m = 2000.0;
/// Ground is shown so far round the tracks, and as far again as they go.
constexpr double kMostBeyond_m = 5000.0;

/// Part of a picture, px.
struct Box {
  int left = 0;
  int top = 0;
  int width = 0;
  int height = 0;
};

/// Bounds of places, longitudes counted on from a reference.
struct Bounds {
  double south = 90.0;
  double north = -90.0;
  double west = 1e9;
  double east = -1e9;

  void extend(double lat_deg, double lon_deg, double reference_deg) {
    const double lon = reference_deg + std::remainder(lon_deg - reference_deg, 360.0);
    south = std::min(south, lat_deg);
    north = std::max(north, lat_deg);
    west = std::min(west, lon);
    east = std::max(east, lon);
  }
};

/// One world's map: latitude and longitude onto a box, equal lengths at its middle.
class Panel {
 public:
  Panel(const std::vector<const MapTrack*>& tracks, const Box& box) : tracks_(tracks), box_(box) {
    const double reference_deg = tracks.front()->places.front().lon_deg;
    Bounds flown;
    Bounds seen;
    for (const MapTrack* track : tracks) {
      for (const geo::Geodetic& place : track->places)
        flown.extend(place.lat_deg, place.lon_deg, reference_deg);
      if (track->ground == nullptr) continue;
      for (const CellRun& run : track->ground->runs) {
        const CellBounds first = bounds_of({run.band, run.first_column});
        const CellBounds last = bounds_of({run.band, run.first_column + run.num_cells - 1});
        seen.extend(first.south_deg, first.west_deg, reference_deg);
        seen.extend(last.north_deg, last.east_deg, reference_deg);
      }
    }
    // Ground may be seen as far as the horizon; the tracks are what the map is of.
    const double more_lat_deg = kMostBeyond_m / kMetresPerDegree + flown.north - flown.south;
    const double south = std::min(flown.south, std::max(seen.south, flown.south - more_lat_deg));
    const double north = std::max(flown.north, std::min(seen.north, flown.north + more_lat_deg));
    middle_lat_deg_ = 0.5 * (south + north);
    shrink_ = std::max(0.01, std::cos(geo::radians_from_degrees(middle_lat_deg_)));
    const double more_lon_deg =
        kMostBeyond_m / kMetresPerDegree / shrink_ + flown.east - flown.west;
    const double west = std::min(flown.west, std::max(seen.west, flown.west - more_lon_deg));
    const double east = std::max(flown.east, std::min(seen.east, flown.east + more_lon_deg));
    middle_lon_deg_ = 0.5 * (west + east);
    constexpr double kRoom = 1.12;  // round what is shown
    const double least_deg = kLeastSpan_m / kMetresPerDegree;
    const double height_deg = kRoom * std::max(north - south, least_deg);
    const double width_deg = kRoom * std::max((east - west) * shrink_, least_deg);
    px_per_degree_ = std::min(box.width / width_deg, box.height / height_deg);
  }

  void draw(core::Image8& image, double margin_m) const {
    core::Image8 picture(box_.width, box_.height, 3, 255);
    Canvas canvas(picture);
    for (const Split split : kDrawn) draw_grounds(split, canvas);
    draw_graticule(canvas);
    for (const Split split : kDrawn) draw_tracks(split, canvas);
    for (int y = 0; y < box_.height; ++y)
      for (int x = 0; x < box_.width; ++x)
        for (int c = 0; c < 3; ++c) image(box_.left + x, box_.top + y, c) = picture(x, y, c);
    Canvas whole(image);
    whole.fill(box_.left - 2, box_.top - 2, box_.width + 4, 2, plot::kInk);
    whole.fill(box_.left - 2, box_.top + box_.height, box_.width + 4, 2, plot::kInk);
    whole.fill(box_.left - 2, box_.top, 2, box_.height, plot::kInk);
    whole.fill(box_.left + box_.width, box_.top, 2, box_.height, plot::kInk);
    draw_labels(whole);
    draw_scale(margin_m, whole);
  }

 private:
  static constexpr std::array kDrawn = {Split::Train, Split::Val, Split::Test};

  Eigen::Vector2d pixel(double lat_deg, double lon_deg) const {
    const double east_deg = std::remainder(lon_deg - middle_lon_deg_, 360.0) * shrink_;
    return {0.5 * box_.width + px_per_degree_ * east_deg,
            0.5 * box_.height - px_per_degree_ * (lat_deg - middle_lat_deg_)};
  }

  void draw_grounds(Split split, Canvas& canvas) const {
    for (const MapTrack* track : tracks_) {
      if (track->split != split || track->ground == nullptr) continue;
      for (const CellRun& run : track->ground->runs) {
        const CellBounds first = bounds_of({run.band, run.first_column});
        const CellBounds last = bounds_of({run.band, run.first_column + run.num_cells - 1});
        const Eigen::Vector2d low = pixel(first.north_deg, first.west_deg);
        const Eigen::Vector2d high = pixel(first.south_deg, last.east_deg);
        const auto left = static_cast<int>(std::floor(low.x()));
        const auto top = static_cast<int>(std::floor(low.y()));
        canvas.fill(left, top, std::max(1, static_cast<int>(std::floor(high.x())) - left),
                    std::max(1, static_cast<int>(std::floor(high.y())) - top),
                    plot::tint_of(split));
      }
    }
  }

  void draw_tracks(Split split, Canvas& canvas) const {
    for (const MapTrack* track : tracks_) {
      if (track->split != split) continue;
      std::vector<Eigen::Vector2d> places;
      for (const geo::Geodetic& place : track->places)
        places.push_back(pixel(place.lat_deg, place.lon_deg));
      canvas.polyline(places, 4.0, plot::kWhite);
      canvas.polyline(places, 2.5, plot::colour_of(split));
      canvas.disc(places.front(), 5.0, plot::kWhite);
      canvas.disc(places.front(), 4.0, plot::colour_of(split));
    }
  }

  /// Multiples of a round step that fit between two values.
  struct Ticks {
    double step = 1.0;
    std::int64_t first = 0;
    std::int64_t last = -1;
  };
  static Ticks ticks_between(double low, double high, int most) {
    const double step = tiler::round_length(2.5 * (high - low) / most);
    return {step, static_cast<std::int64_t>(std::ceil(low / step)),
            static_cast<std::int64_t>(std::floor(high / step))};
  }
  Ticks lat_ticks() const {
    const double half_deg = 0.5 * box_.height / px_per_degree_;
    return ticks_between(middle_lat_deg_ - half_deg, middle_lat_deg_ + half_deg, box_.height / 60);
  }
  Ticks lon_ticks() const {
    const double half_deg = 0.5 * box_.width / px_per_degree_ / shrink_;
    return ticks_between(middle_lon_deg_ - half_deg, middle_lon_deg_ + half_deg, box_.width / 90);
  }

  void draw_graticule(Canvas& canvas) const {
    const Ticks lats = lat_ticks();
    for (std::int64_t i = lats.first; i <= lats.last; ++i) {
      const double y = pixel(static_cast<double>(i) * lats.step, middle_lon_deg_).y();
      canvas.line({0.0, y}, {1.0 * box_.width, y}, 1.0, plot::kGrid);
    }
    const Ticks lons = lon_ticks();
    for (std::int64_t i = lons.first; i <= lons.last; ++i) {
      const double x = pixel(middle_lat_deg_, static_cast<double>(i) * lons.step).x();
      canvas.line({x, 0.0}, {x, 1.0 * box_.height}, 1.0, plot::kGrid);
    }
  }

  void draw_labels(Canvas& canvas) const {
    const Ticks lats = lat_ticks();
    for (std::int64_t i = lats.first; i <= lats.last; ++i) {
      const double lat_deg = static_cast<double>(i) * lats.step;
      const std::string label = plot::angle_text(lat_deg, lats.step, 'N', 'S');
      canvas.text(box_.left - 8 - Canvas::text_width_px(label, kScale),
                  box_.top + static_cast<int>(pixel(lat_deg, middle_lon_deg_).y()) - 7, label,
                  kScale, plot::kInk);
    }
    const Ticks lons = lon_ticks();
    for (std::int64_t i = lons.first; i <= lons.last; ++i) {
      const double lon_deg = static_cast<double>(i) * lons.step;
      const std::string label =
          plot::angle_text(std::remainder(lon_deg, 360.0), lons.step, 'E', 'W');
      canvas.text(box_.left + static_cast<int>(pixel(middle_lat_deg_, lon_deg).x()) -
                      Canvas::text_width_px(label, kScale) / 2,
                  box_.top + box_.height + 8, label, kScale, plot::kInk);
    }
  }

  /// Below the map: a scale bar, and beside it the margin where it is long enough to be seen.
  void draw_scale(double margin_m, Canvas& canvas) const {
    const double metres_per_px = kMetresPerDegree / px_per_degree_;
    const int top = box_.top + box_.height + 38;
    tiler::draw_scale_bar(canvas, box_.left, top, kScale, metres_per_px, 0.3 * box_.width,
                          plot::kInk);
    const double margin_px = margin_m / metres_per_px;
    constexpr double kLeast_px = 4.0;
    if (margin_px < kLeast_px || margin_px > 0.5 * box_.width) return;
    const int left = box_.left + box_.width * 2 / 5;
    canvas.fill(left, top + 2 * kScale, static_cast<int>(std::lround(margin_px)), 2 * kScale,
                plot::kMargin);
    canvas.text(left, top + kLine_px, fmt::format("{} between splits", plot::metres_text(margin_m)),
                kScale, plot::kInk);
  }

  const std::vector<const MapTrack*>& tracks_;
  Box box_;
  double middle_lat_deg_ = 0.0;
  double middle_lon_deg_ = 0.0;
  double shrink_ = 1.0;  ///< of a degree of longitude against one of latitude
  double px_per_degree_ = 1.0;
};

using World = std::pair<std::string, std::vector<const MapTrack*>>;

/// The worlds with most tracks, by name.
std::vector<World> shown_worlds(const std::vector<MapTrack>& tracks) {
  std::map<std::string, std::vector<const MapTrack*>> by_name;
  for (const MapTrack& track : tracks)
    if (!track.places.empty()) by_name[track.world].push_back(&track);
  std::vector<World> worlds(by_name.begin(), by_name.end());
  std::stable_sort(worlds.begin(), worlds.end(), [](const World& a, const World& b) {
    return a.second.size() > b.second.size();
  });
  if (worlds.size() > kMostPanels) worlds.resize(kMostPanels);
  std::sort(worlds.begin(), worlds.end(),
            [](const World& a, const World& b) { return a.first < b.first; });
  return worlds;
}

void draw_legend(const std::vector<MapTrack>& tracks, Canvas& canvas) {
  int x = 16;
  for (std::size_t k = 0; k < kSplitNames.size(); ++k) {
    const auto split = static_cast<Split>(k);
    const auto count = std::count_if(tracks.begin(), tracks.end(),
                                     [&](const MapTrack& track) { return track.split == split; });
    const std::string words = fmt::format("{} ({})", kSplitNames[k], count);
    canvas.fill(x, kLine_px / 2 + 2, 24, 10, plot::colour_of(split));
    canvas.text(x + 32, kLine_px / 2, words, kScale, plot::kInk);
    x += 32 + Canvas::text_width_px(words, kScale) + 32;
  }
}

}  // namespace

core::Image8 draw_sequence_map(const std::vector<MapTrack>& tracks, double margin_m) {
  const std::vector<World> worlds = shown_worlds(tracks);
  const int num_columns = worlds.size() > 1 ? 2 : 1;
  const int num_rows =
      std::max(1, (static_cast<int>(worlds.size()) + num_columns - 1) / num_columns);
  const Box inner = worlds.size() > 1 ? Box{124, 34, 480, 400} : Box{124, 34, 860, 680};
  const int column_px = inner.left + inner.width + 64;
  const int row_px = inner.top + inner.height + 84;
  core::Image8 image(num_columns * column_px, kLegend_px + num_rows * row_px, 3, 255);
  Canvas canvas(image);
  draw_legend(tracks, canvas);
  for (std::size_t i = 0; i < worlds.size(); ++i) {
    const int column = static_cast<int>(i) % num_columns;
    const int row = static_cast<int>(i) / num_columns;
    Box box = inner;
    box.left += column * column_px;
    box.top += kLegend_px + row * row_px;
    canvas.text(box.left, box.top - kLine_px, plot::fitting(worlds[i].first, box.width, kScale),
                kScale, plot::kInk);
    Panel(worlds[i].second, box).draw(image, margin_m);
  }
  return image;
}

}  // namespace terracast::batch
