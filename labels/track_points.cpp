#include "labels/track_points.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <set>

#include "capture/labels.h"
#include "core/instance_id.h"
#include "core/parallel.h"
#include "core/random.h"

namespace terracast::labels {
namespace {

using Eigen::Vector2d;

/// How far from its pixel's centre a point may be seen in the image that it was drawn from: geo::find_seen knows the
/// time of a line to a millionth.
constexpr double kSamePixel_px = 1e-6;

enum class Of : std::uint64_t { Standing = 1, Moving = 2 };

/// Draws points of one kind.
class TrackDrawer {
 public:
  TrackDrawer(const capture::SequenceReader& sequence, const Matcher& matcher, Of of,
              std::uint64_t seed, std::span<const int> cameras)
      : sequence_(sequence), matcher_(matcher), of_(of), seed_(seed) {
    const std::size_t num_images = sequence.frames().size() * cameras.size();
    for (const std::size_t place : golden_order(num_images)) {
      const auto frame = static_cast<int>(place / cameras.size());
      if (of == Of::Standing || has_bodies(frame))
        images_.push_back({.image = {frame, cameras[place % cameras.size()]}});
    }
  }

  /// So many more, or all that there are.
  void draw(std::int64_t count) {
    const auto wanted = points_.size() + static_cast<std::size_t>(count);
    while (points_.size() < wanted) {
      const std::map<std::size_t, std::vector<std::size_t>> visits =
          next_visits(wanted - points_.size());
      if (visits.empty()) return;
      visit(visits);
    }
  }
  const std::vector<TrackedPoint>& points() const { return points_; }

 private:
  struct Image {
    ImageOf image;
    bool is_exhausted = false;        ///< it has no more pixels
    std::uint64_t num_drawn = 0;      ///< random numbers
    std::set<int> drawn_pixels = {};  ///< by their index
  };

  bool has_bodies(int frame) const {
    const auto& bodies = sequence_.frames()[static_cast<std::size_t>(frame)].moving;
    return std::any_of(bodies.begin(), bodies.end(), [](const auto& body) { return bool(body); });
  }

  /// Which of the next visits are to which image, going on in turn.
  std::map<std::size_t, std::vector<std::size_t>> next_visits(std::size_t count) {
    std::map<std::size_t, std::vector<std::size_t>> visits;
    std::size_t num_exhausted_in_turn = 0;
    for (std::size_t number = 0; number < count && num_exhausted_in_turn < images_.size();) {
      const std::size_t at = next_image_;
      next_image_ = (next_image_ + 1) % images_.size();
      if (images_[at].is_exhausted) {
        ++num_exhausted_in_turn;
        continue;
      }
      num_exhausted_in_turn = 0;
      visits[at].push_back(number++);
    }
    return visits;
  }

  /// Visits that find a point, in their order.
  void visit(const std::map<std::size_t, std::vector<std::size_t>>& visits) {
    std::vector<std::pair<std::size_t, const std::vector<std::size_t>*>> images;
    std::size_t num_visits = 0;
    for (const auto& [image, numbers] : visits) {
      images.emplace_back(image, &numbers);
      num_visits += numbers.size();
    }
    std::vector<std::optional<TrackedPoint>> found(num_visits);
    core::parallel_for(static_cast<std::int64_t>(images.size()), [&](std::int64_t i) {
      const auto& [image, numbers] = images[static_cast<std::size_t>(i)];
      const auto points = points_of(images_[image], numbers->size());
      for (std::size_t k = 0; k < points.size(); ++k) found[(*numbers)[k]] = points[k];
    });
    for (const std::optional<TrackedPoint>& point : found)
      if (point) points_.push_back(*point);
  }

  /// Pixels that may still be drawn, by the thing that they show; of what stands all are one.
  std::vector<std::vector<int>> pixels_left(const capture::CameraFrame& facts,
                                            const Image& image) const {
    std::map<std::uint32_t, std::vector<int>> by_thing;
    const auto num_pixels = static_cast<int>(facts.range_m.num_pixels());
    for (int i = 0; i < num_pixels; ++i) {
      const auto at = static_cast<std::size_t>(i);
      const std::uint32_t id = facts.instance_id.data()[at];
      if (!std::isfinite(facts.range_m.data()[at]) ||
          core::is_moving_id(id) != (of_ == Of::Moving) || image.drawn_pixels.contains(i))
        continue;
      by_thing[of_ == Of::Moving ? id : 0].push_back(i);
    }
    std::vector<std::vector<int>> groups;
    for (auto& [id, pixels] : by_thing) groups.push_back(std::move(pixels));
    return groups;
  }

  /// What a number of visits finds in an image; less where its pixels do not suffice.
  std::vector<std::optional<TrackedPoint>> points_of(Image& image, std::size_t num_visits) const {
    const capture::CameraFrame facts = sequence_.read_camera(image.image.frame, image.image.camera,
                                                             capture::SequenceReader::kFacts);
    std::vector<std::vector<int>> groups = pixels_left(facts, image);
    const std::uint64_t stream =
        core::stream_of(core::stream_of(static_cast<std::uint64_t>(of_),
                                        static_cast<std::uint64_t>(image.image.frame)),
                        static_cast<std::uint64_t>(image.image.camera));
    const auto draw_below = [&](std::size_t count) {
      return static_cast<std::size_t>(core::random_unit(seed_, stream, image.num_drawn++) *
                                      static_cast<double>(count));
    };
    std::vector<Eigen::Vector2i> pixels;
    while (pixels.size() < num_visits && !groups.empty()) {
      const std::size_t group = draw_below(groups.size());
      std::vector<int>& left = groups[group];
      const std::size_t place = draw_below(left.size());
      image.drawn_pixels.insert(left[place]);
      pixels.emplace_back(left[place] % facts.range_m.width(), left[place] / facts.range_m.width());
      left[place] = left.back();
      left.pop_back();
      if (left.empty()) groups.erase(groups.begin() + static_cast<std::ptrdiff_t>(group));
    }
    image.is_exhausted = groups.empty();
    return tracked(image.image, facts, pixels);
  }

  /// The points that pixels show; nothing where the camera does not see the very point there.
  std::vector<std::optional<TrackedPoint>> tracked(
      const ImageOf& image, const capture::CameraFrame& facts,
      const std::vector<Eigen::Vector2i>& pixels) const {
    std::vector<ShownPoint> shown;
    for (const auto& point : matcher_.points(image, facts, pixels)) shown.push_back(point.value());
    const std::vector<std::optional<Sighting>> sightings = matcher_.follow(shown, image);
    std::vector<std::optional<TrackedPoint>> points(pixels.size());
    for (std::size_t i = 0; i < pixels.size(); ++i) {
      const int x = pixels[i].x(), y = pixels[i].y();
      if (!sightings[i] || !sightings[i]->is_visible ||
          (sightings[i]->pixel - capture::pixel_center(x, y)).norm() > kSamePixel_px)
        continue;
      points[i] = TrackedPoint{.point = shown[i],
                               .image = image,
                               .pixel = pixels[i],
                               .instance_id = facts.instance_id(x, y),
                               .semantic_id = facts.semantic_id(x, y)};
    }
    return points;
  }

  const capture::SequenceReader& sequence_;
  const Matcher& matcher_;
  const Of of_;
  const std::uint64_t seed_;
  std::vector<Image> images_;  ///< in turn
  std::size_t next_image_ = 0;
  std::vector<TrackedPoint> points_;
};

/// The one kind among the other, evenly.
std::vector<TrackedPoint> mixed(const std::vector<TrackedPoint>& standing,
                                const std::vector<TrackedPoint>& moving) {
  const std::size_t count = standing.size() + moving.size();
  std::vector<TrackedPoint> all;
  std::size_t num_moving = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const bool is_moving = (i + 1) * moving.size() / count > num_moving;
    all.push_back(is_moving ? moving[num_moving] : standing[i - num_moving]);
    num_moving += is_moving ? 1 : 0;
  }
  return all;
}

}  // namespace

std::vector<std::size_t> golden_order(std::size_t count) {
  auto step = static_cast<std::size_t>(std::llround(0.6180339887498949 * double(count)));
  step = std::max<std::size_t>(step, 1);
  while (std::gcd(step, count) > 1) ++step;
  std::vector<std::size_t> order;
  for (std::size_t i = 0, place = count / 2; i < count; ++i, place = (place + step) % count)
    order.push_back(place);
  return order;
}

std::vector<TrackedPoint> draw_tracks(const capture::SequenceReader& sequence,
                                      const Matcher& matcher, const TrackDraw& draw,
                                      std::span<const int> cameras) {
  const auto has = [](const TrackDrawer& drawer) {
    return static_cast<std::int64_t>(drawer.points().size());
  };
  TrackDrawer standing(sequence, matcher, Of::Standing, draw.seed, cameras);
  TrackDrawer moving(sequence, matcher, Of::Moving, draw.seed, cameras);
  moving.draw(std::llround(draw.moving_share * static_cast<double>(draw.num_points)));
  standing.draw(draw.num_points - has(moving));
  if (draw.moving_share > 0.0) moving.draw(draw.num_points - has(moving) - has(standing));
  return mixed(standing.points(), moving.points());
}

}  // namespace terracast::labels
