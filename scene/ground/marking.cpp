#include "scene/ground/marking.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <span>

#include "scene/ground/pattern.h"
#include "world/road_marks.h"

namespace terracast::scene {
namespace {

using world::Marking;
using world::PaintSample;

enum class MarkColor { White, Yellow };

/// A rectangle of paint, or dashes of one.
struct Stripe {
  double across_from_m;  ///< to the left of the line
  double across_to_m;
  double along_from_m;  ///< along the whole line
  double along_to_m;
  double dash_m = 0.0;    ///< painted of each period, from along_from_m on
  double period_m = 0.0;  ///< 0: unbroken
  MarkColor color = MarkColor::White;
};

/// A stroke of a number: corners anticlockwise, x across to the right and y along, convex.
struct Stroke {
  std::array<Eigen::Vector2d, 4> corners;
};

/// What is asked of marks at a place: whether they hold it, or what share of a square.
class Window {
 public:
  Window(const PaintSample& paint, double width_m)
      : across_m_(paint.across_m), along_m_(paint.along_m), width_m_(width_m) {}

  double half_m() const { return 0.5 * width_m_; }

  double share_of(const Stripe& stripe) const {
    const double across =
        share_within(across_m_, width_m_, stripe.across_from_m, stripe.across_to_m);
    if (across <= 0.0) return 0.0;
    if (stripe.period_m == 0.0)
      return across * share_within(along_m_, width_m_, stripe.along_from_m, stripe.along_to_m);
    const double low = std::max(along_m_ - half_m(), stripe.along_from_m);
    const double high = std::min(along_m_ + half_m(), stripe.along_to_m);
    if (low > high) return 0.0;
    const double from = low - stripe.along_from_m;
    const double to = high - stripe.along_from_m;
    if (width_m_ <= 0.0) {
      const double in_period = from - std::floor(from / stripe.period_m) * stripe.period_m;
      return in_period < stripe.dash_m ? across : 0.0;
    }
    return across *
           (bars_up_to(to, stripe.dash_m, stripe.period_m) -
            bars_up_to(from, stripe.dash_m, stripe.period_m)) /
           width_m_;
  }

  /// right_m, ahead_m   of the place in the stroke's frame
  double share_of(const Stroke& stroke, double right_m, double ahead_m) const {
    if (width_m_ <= 0.0) return holds(stroke, {right_m, ahead_m}) ? 1.0 : 0.0;
    return area_within(stroke, {right_m, ahead_m}) / (width_m_ * width_m_);
  }

 private:
  static bool holds(const Stroke& stroke, const Eigen::Vector2d& place) {
    for (std::size_t i = 0; i < stroke.corners.size(); ++i) {
      const Eigen::Vector2d from = stroke.corners[i];
      const Eigen::Vector2d edge = stroke.corners[(i + 1) % stroke.corners.size()] - from;
      const Eigen::Vector2d to_place = place - from;
      if (edge.x() * to_place.y() - edge.y() * to_place.x() < 0.0) return false;
    }
    return true;
  }

  /// Of the stroke, within the square: cut by its four sides one after the other (Sutherland and Hodgman
  /// 1974), then summed by the shoelace formula.
  double area_within(const Stroke& stroke, const Eigen::Vector2d& center) const {
    constexpr std::size_t kMostCorners = 8;  // each cut of a convex shape adds one at most
    std::array<Eigen::Vector2d, kMostCorners> shape;
    std::size_t count = stroke.corners.size();
    std::copy(stroke.corners.begin(), stroke.corners.end(), shape.begin());
    for (int side = 0; side < 4; ++side) {
      const int axis = side / 2;
      const double sign = side % 2 == 0 ? 1.0 : -1.0;
      const auto inside = [&](const Eigen::Vector2d& p) {
        return half_m() - sign * (p[axis] - center[axis]);
      };
      std::array<Eigen::Vector2d, kMostCorners> kept;
      std::size_t num_kept = 0;
      for (std::size_t i = 0; i < count; ++i) {
        const Eigen::Vector2d& p = shape[i];
        const Eigen::Vector2d& q = shape[(i + 1) % count];
        const double at_p = inside(p);
        const double at_q = inside(q);
        if (at_p >= 0.0) kept[num_kept++] = p;
        if ((at_p > 0.0 && at_q < 0.0) || (at_p < 0.0 && at_q > 0.0))
          kept[num_kept++] = p + at_p / (at_p - at_q) * (q - p);
      }
      shape = kept;
      count = num_kept;
      if (count < 3) return 0.0;
    }
    double twice_area = 0.0;
    for (std::size_t i = 0; i < count; ++i) {
      const Eigen::Vector2d p = shape[i] - center;
      const Eigen::Vector2d q = shape[(i + 1) % count] - center;
      twice_area += p.x() * q.y() - p.y() * q.x();
    }
    return 0.5 * twice_area;
  }

  double across_m_;
  double along_m_;
  double width_m_;
};

MarkCover cover_of(const Window& window, const Stripe& stripe) {
  const double share = window.share_of(stripe);
  return stripe.color == MarkColor::White ? MarkCover{.white = share, .yellow = 0.0}
                                          : MarkCover{.white = 0.0, .yellow = share};
}

// Roads: RMS-1 (1993), as in world/road_marks.h. Broken lines: 4 m of 12 outside towns, 6 m of 18 on motorways.
using world::kEdgeStrip_m;
using world::kLine_m;
using world::kMotorwayBroadLine_m;
using world::kMotorwayEdgeStrip_m;
using world::kMotorwayLane_m;
using world::kMotorwayLine_m;
using world::kMotorwayShoulder_m;
// Zebra crossings: sign 293 of the German StVO, bars of 0.50 m with as much between.
constexpr double kZebraBar_m = 0.50;
// Parking places: EAR 05, 2.50 m x 5.00 m.
constexpr double kStandWidth_m = 2.50;
constexpr double kStandLength_m = 5.00;
// Taxiways: ICAO Annex 14, 5.2.8: a yellow line of at least 0.15 m.
constexpr double kTaxiLine_m = 0.15;

/// The part of a strip that has marks, for lines along it.
struct AlongStrip {
  double from_m;
  double to_m;

  Stripe solid(double center_m, double width_m, MarkColor color = MarkColor::White) const {
    return {.across_from_m = center_m - 0.5 * width_m,
            .across_to_m = center_m + 0.5 * width_m,
            .along_from_m = from_m,
            .along_to_m = to_m,
            .color = color};
  }
  Stripe broken(double center_m, double width_m, double dash_m, double period_m) const {
    Stripe stripe = solid(center_m, width_m);
    stripe.dash_m = dash_m;
    stripe.period_m = period_m;
    return stripe;
  }
};

template <class Visit>
void visit_lanes(const PaintSample& paint, const AlongStrip& strip, const Visit& visit) {
  const double edge_m = paint.half_width_m - kEdgeStrip_m - 0.5 * kLine_m;
  if (edge_m <= 0.0) return;
  visit(strip.solid(edge_m, kLine_m));
  visit(strip.solid(-edge_m, kLine_m));
  for (int lane = 1; lane < paint.num_lanes; ++lane)
    visit(strip.broken(edge_m - 2.0 * edge_m * lane / paint.num_lanes, kLine_m, 4.0, 12.0));
}

template <class Visit>
void visit_motorway(const PaintSample& paint, const AlongStrip& strip, const Visit& visit) {
  const double left_m = paint.half_width_m - kMotorwayEdgeStrip_m - 0.5 * kMotorwayLine_m;
  const double lanes_m = kMotorwayLane_m * paint.num_lanes;
  const double shoulder_m =
      std::clamp(paint.half_width_m + left_m - lanes_m, kMotorwayEdgeStrip_m, kMotorwayShoulder_m);
  const double right_m = -paint.half_width_m + shoulder_m + 0.5 * kMotorwayBroadLine_m;
  if (left_m <= right_m) return;
  visit(strip.solid(left_m, kMotorwayLine_m));
  visit(strip.solid(right_m, kMotorwayBroadLine_m));
  for (int lane = 1; lane < paint.num_lanes; ++lane)
    visit(strip.broken(left_m + (right_m - left_m) * lane / paint.num_lanes, kMotorwayLine_m, 6.0,
                       18.0));
}

template <class Visit>
void visit_stands(const PaintSample& paint, const AlongStrip& strip, const Visit& visit) {
  const auto bays = [&](double across_from_m, double across_to_m) {
    visit(Stripe{.across_from_m = across_from_m,
                 .across_to_m = across_to_m,
                 .along_from_m = strip.from_m,
                 .along_to_m = strip.to_m,
                 .dash_m = kLine_m,
                 .period_m = kStandWidth_m});
  };
  if (paint.half_width_m <= kStandLength_m) {
    bays(-paint.half_width_m, paint.half_width_m);
  } else {  // a row on each side of a lane
    bays(-paint.half_width_m, kStandLength_m - paint.half_width_m);
    bays(paint.half_width_m - kStandLength_m, paint.half_width_m);
  }
}

// ---- Runways: ICAO Annex 14, volume I, chapter 5.2 (8th edition, 2018) ----

constexpr double kThresholdGap_m = 6.0;      // 5.2.4.4
constexpr double kThresholdLength_m = 30.0;  // 5.2.4.6
// 5.2.4.6: width and spacing, about 1.8 m, double at the middle; as far as 3 m from the edges or 27 m from
// the middle.
constexpr double kThresholdStripe_m = 1.8;
// Figure 5-2: 12 m before and behind the number, which is 9 m high (5.2.2.6).
constexpr double kNumberGap_m = 12.0;
constexpr double kNumberHeight_m = 9.0;
constexpr double kNumberWidth_m = 3.0;
constexpr double kDigitPitch_m = 5.3;
constexpr double kNumberFrom_m = kThresholdGap_m + kThresholdLength_m + kNumberGap_m;
constexpr double kCenterFrom_m = kNumberFrom_m + kNumberHeight_m + kNumberGap_m;
constexpr double kCenterDash_m = 30.0;    // 5.2.3.3: stripe and gap 50 to 75 m together,
constexpr double kCenterPeriod_m = 50.0;  // the stripe not under 30 m
constexpr double kTouchdownLength_m = 22.5;
constexpr double kTouchdownWidth_m = 3.0;
constexpr double kTouchdownSpacing_m = 150.0;
/// Shorter than this between thresholds a runway has a centre line and edges only.
constexpr double kLeastRunway_m = 300.0;

/// 5.2.4.5: stripes of a threshold by the runway's width.
int num_threshold_stripes(double width_m) {
  if (width_m < 20.5) return 4;   // 18 m
  if (width_m < 26.5) return 6;   // 23 m
  if (width_m < 37.5) return 8;   // 30 m
  if (width_m < 52.5) return 12;  // 45 m
  return 16;                      // 60 m
}

/// Table 5-1, by the landing distance available.
struct AimingPoint {
  double distance_m;
  double length_m;
  double width_m;
  double spacing_m;  ///< between the inner sides
};
AimingPoint aiming_point(double landing_m) {
  if (landing_m < 800.0) return {150.0, 30.0, 4.0, 6.0};
  if (landing_m < 1200.0) return {250.0, 30.0, 6.0, 9.0};
  if (landing_m < 2400.0) return {300.0, 45.0, 6.0, 18.0};
  return {400.0, 45.0, 6.0, 18.0};
}

/// 5.2.6.3: pairs of touchdown zone marks; those within 50 m of the aiming point are left out (5.2.6.5).
int num_touchdown_pairs(double landing_m) {
  if (landing_m < 900.0) return 1;
  if (landing_m < 1200.0) return 2;
  if (landing_m < 1500.0) return 3;
  if (landing_m < 2400.0) return 4;
  return 6;
}

using Quad = std::array<std::array<double, 2>, 4>;

/// Digits 3 m wide and 9 m high in strokes of 0.8 m across and 1.5 m along, close to Figure 5-3, corners
/// cut where that has them round. No two strokes lie over each other.
std::span<const Quad> strokes_of(int digit) {
  static constexpr Quad kLeft = {{{0.0, 1.0}, {0.8, 0.0}, {0.8, 9.0}, {0.0, 8.0}}};
  static constexpr Quad kRight = {{{2.2, 0.0}, {3.0, 1.0}, {3.0, 8.0}, {2.2, 9.0}}};
  static constexpr Quad kTop = {{{0.8, 7.5}, {2.2, 7.5}, {2.2, 9.0}, {0.8, 9.0}}};
  static constexpr Quad kBottom = {{{0.8, 0.0}, {2.2, 0.0}, {2.2, 1.5}, {0.8, 1.5}}};
  static constexpr Quad kMiddle = {{{0.8, 3.75}, {2.2, 3.75}, {2.2, 5.25}, {0.8, 5.25}}};
  static constexpr Quad kLeftStubBelow = {{{0.0, 1.0}, {0.8, 0.0}, {0.8, 1.5}, {0.0, 2.5}}};
  static constexpr Quad kLeftStubAbove = {{{0.0, 6.5}, {0.8, 7.5}, {0.8, 9.0}, {0.0, 8.0}}};
  static constexpr Quad kRightStubAbove = {{{2.2, 7.5}, {3.0, 6.5}, {3.0, 8.0}, {2.2, 9.0}}};
  static constexpr Quad kRightBelow = {{{2.2, 0.0}, {3.0, 1.0}, {3.0, 4.25}, {2.2, 5.25}}};
  static constexpr Quad kLeftAbove = {{{0.0, 4.75}, {0.8, 3.75}, {0.8, 9.0}, {0.0, 8.0}}};
  static constexpr Quad kZero[] = {kLeft, kRight, kTop, kBottom};
  static constexpr Quad kOne[] = {{{{1.3, 0.0}, {2.1, 0.0}, {2.1, 9.0}, {1.3, 9.0}}},
                                  {{{0.5, 6.3}, {1.3, 7.3}, {1.3, 9.0}, {0.5, 7.9}}}};
  static constexpr Quad kTwo[] = {kLeftStubAbove,
                                  kTop,
                                  {{{2.2, 5.0}, {3.0, 5.0}, {3.0, 8.0}, {2.2, 9.0}}},
                                  {{{0.0, 1.5}, {0.95, 1.5}, {3.0, 5.0}, {2.2, 5.0}}},
                                  {{{0.0, 0.0}, {3.0, 0.0}, {3.0, 1.5}, {0.0, 1.5}}}};
  static constexpr Quad kThree[] = {
      kLeftStubAbove, kTop,    {{{1.2, 3.75}, {2.2, 3.75}, {2.2, 5.25}, {1.2, 5.25}}},
      kRight,         kBottom, kLeftStubBelow};
  static constexpr Quad kFour[] = {{{{1.8, 0.0}, {2.6, 0.0}, {2.6, 9.0}, {1.8, 9.0}}},
                                   {{{0.0, 2.0}, {1.8, 2.0}, {1.8, 3.5}, {0.0, 3.5}}},
                                   {{{2.6, 2.0}, {3.0, 2.0}, {3.0, 3.5}, {2.6, 3.5}}},
                                   {{{0.0, 3.5}, {0.85, 3.5}, {1.8, 7.0}, {1.8, 9.0}}}};
  static constexpr Quad kFive[] = {{{{0.0, 7.5}, {3.0, 7.5}, {3.0, 9.0}, {0.0, 9.0}}},
                                   {{{0.0, 3.75}, {0.8, 3.75}, {0.8, 7.5}, {0.0, 7.5}}},
                                   kMiddle,
                                   kRightBelow,
                                   kBottom,
                                   kLeftStubBelow};
  static constexpr Quad kSix[] = {kLeft, kTop, kRightStubAbove, kMiddle, kRightBelow, kBottom};
  static constexpr Quad kSeven[] = {{{{0.0, 7.5}, {3.0, 7.5}, {3.0, 9.0}, {0.0, 9.0}}},
                                    {{{0.6, 0.0}, {1.45, 0.0}, {3.0, 7.5}, {2.15, 7.5}}}};
  static constexpr Quad kEightLeftBelow = {{{0.0, 1.0}, {0.8, 0.0}, {0.8, 4.5}, {0.0, 3.7}}};
  static constexpr Quad kEightLeftAbove = {{{0.0, 5.3}, {0.8, 4.5}, {0.8, 9.0}, {0.0, 8.0}}};
  static constexpr Quad kEightRightBelow = {{{2.2, 0.0}, {3.0, 1.0}, {3.0, 3.7}, {2.2, 4.5}}};
  static constexpr Quad kEightRightAbove = {{{2.2, 4.5}, {3.0, 5.3}, {3.0, 8.0}, {2.2, 9.0}}};
  static constexpr Quad kEight[] = {
      kEightLeftBelow, kEightLeftAbove, kEightRightBelow, kEightRightAbove, kTop, kMiddle, kBottom};
  static constexpr Quad kNine[] = {kRight, kTop, kLeftStubBelow, kMiddle, kLeftAbove, kBottom};
  switch (digit) {
    case 0:
      return kZero;
    case 1:
      return kOne;
    case 2:
      return kTwo;
    case 3:
      return kThree;
    case 4:
      return kFour;
    case 5:
      return kFive;
    case 6:
      return kSix;
    case 7:
      return kSeven;
    case 8:
      return kEight;
    default:
      return kNine;
  }
}

/// One end of a runway, as who lands there sees it.
struct RunwayEnd {
  const PaintSample& paint;
  bool is_start;    ///< of the strip's line
  int number;       ///< 1 … 36
  double from_m;    ///< the threshold, along the line
  double length_m;  ///< between the thresholds
  double ahead_m;   ///< of the place, from the threshold
  double right_m;

  /// A rectangle ahead of the threshold; it is symmetric about the middle with its twin.
  template <class Visit>
  void visit_pair(double ahead_from_m, double ahead_to_m, double inner_m, double outer_m,
                  const Visit& visit) const {
    const double a = is_start ? from_m + ahead_from_m : from_m - ahead_to_m;
    const double b = is_start ? from_m + ahead_to_m : from_m - ahead_from_m;
    visit(Stripe{
        .across_from_m = inner_m, .across_to_m = outer_m, .along_from_m = a, .along_to_m = b});
    visit(Stripe{
        .across_from_m = -outer_m, .across_to_m = -inner_m, .along_from_m = a, .along_to_m = b});
  }

  template <class Visit>
  void visit_stripes(double margin_m, const Visit& visit) const {
    const double half_m = paint.half_width_m;
    if (ahead_m - margin_m <= kThresholdGap_m + kThresholdLength_m) {
      const int count = num_threshold_stripes(2.0 * half_m);
      const double width_m =
          std::min(kThresholdStripe_m, std::min(half_m - 3.0, 27.0) / count);  // 5.2.4.6
      for (int i = 0; i < count / 2; ++i)
        visit_pair(kThresholdGap_m, kThresholdGap_m + kThresholdLength_m, width_m * (1 + 2 * i),
                   width_m * (2 + 2 * i), visit);
    }
    if (ahead_m + margin_m < kCenterFrom_m) return;
    const AimingPoint aim = aiming_point(length_m);
    const double inner_m = std::min(0.5 * aim.spacing_m, 0.5 * (half_m - 1.0));
    const double last_m = 0.5 * length_m - 100.0;  // so far the marks of an end go
    if (aim.distance_m + aim.length_m <= last_m)
      visit_pair(aim.distance_m, aim.distance_m + aim.length_m, inner_m,
                 std::min(inner_m + aim.width_m, half_m - 1.0), visit);
    for (int pair = 1; pair <= num_touchdown_pairs(length_m); ++pair) {
      const double at_m = pair * kTouchdownSpacing_m;
      if (std::abs(at_m - aim.distance_m) <= 50.0 || at_m + kTouchdownLength_m > last_m) continue;
      visit_pair(at_m, at_m + kTouchdownLength_m, inner_m,
                 std::min(inner_m + kTouchdownWidth_m, half_m - 1.0), visit);
    }
  }

  double number_share(const Window& window) const {
    const double low_m = ahead_m - window.half_m();
    const double high_m = ahead_m + window.half_m();
    if (high_m < kNumberFrom_m || low_m > kNumberFrom_m + kNumberHeight_m) return 0.0;
    double share = 0.0;
    for (const int place : {0, 1}) {
      const double left_m = place == 0 ? -0.5 * (kDigitPitch_m + kNumberWidth_m)
                                       : 0.5 * (kDigitPitch_m - kNumberWidth_m);
      for (const Quad& quad : strokes_of(place == 0 ? number / 10 : number % 10)) {
        Stroke stroke;
        for (std::size_t k = 0; k < quad.size(); ++k)
          stroke.corners[k] = {left_m + quad[k][0], kNumberFrom_m + quad[k][1]};
        share += window.share_of(stroke, right_m, ahead_m);
      }
    }
    return share;
  }
};

MarkCover runway_marks(const PaintSample& paint, const Window& window) {
  MarkCover cover;
  const auto add = [&](const Stripe& stripe) { cover.white += window.share_of(stripe); };
  const double first_m = paint.unmarked_start_m;
  const double last_m = paint.whole_m - paint.unmarked_end_m;
  const double length_m = last_m - first_m;
  const double half_m = paint.half_width_m;

  // 5.2.7.4: side stripes 0.9 m wide on runways of 30 m and more, 0.45 m on others.
  const AlongStrip whole{first_m, last_m};
  const double edge_m = half_m >= 15.0 ? 0.9 : 0.45;
  add(whole.solid(half_m - 0.5 * edge_m, edge_m));
  add(whole.solid(-half_m + 0.5 * edge_m, edge_m));

  // 5.2.3.4: 0.9 m where precision approaches of category II and III come in, 0.45 m, 0.3 m; taken by
  // width, which goes with them.
  const double line_m = half_m >= 22.5 ? 0.9 : half_m >= 15.0 ? 0.45 : 0.3;
  const bool is_long = length_m >= kLeastRunway_m;
  const double center_from_m = first_m + (is_long ? kCenterFrom_m : 0.0);
  const double center_m = last_m - (is_long ? kCenterFrom_m : 0.0) - center_from_m;
  const double num_periods = std::floor((center_m - kCenterDash_m) / kCenterPeriod_m);
  const AlongStrip center{center_from_m, center_from_m + center_m};
  if (num_periods >= 1.0)
    add(center.broken(0.0, line_m, kCenterDash_m, (center_m - kCenterDash_m) / num_periods));
  else
    add(center.solid(0.0, line_m));
  if (!is_long) return cover;

  const int number = std::clamp<int>(paint.num_lanes, 1, 36);
  const RunwayEnd ends[2] = {{.paint = paint,
                              .is_start = true,
                              .number = number,
                              .from_m = first_m,
                              .length_m = length_m,
                              .ahead_m = paint.along_m - first_m,
                              .right_m = -paint.across_m},
                             {.paint = paint,
                              .is_start = false,
                              .number = (number + 17) % 36 + 1,
                              .from_m = last_m,
                              .length_m = length_m,
                              .ahead_m = last_m - paint.along_m,
                              .right_m = paint.across_m}};
  for (const RunwayEnd& end : ends) {
    if (end.ahead_m > 0.5 * length_m + window.half_m()) continue;
    end.visit_stripes(window.half_m(), add);
    cover.white += end.number_share(window);
  }
  return cover;
}

MarkCover marks_of(const PaintSample& paint, const Window& window) {
  const AlongStrip strip{paint.unmarked_start_m, paint.whole_m - paint.unmarked_end_m};
  MarkCover cover;
  if (!paint.is_painted || strip.from_m >= strip.to_m) return cover;
  const auto add = [&](const Stripe& stripe) {
    const MarkCover more = cover_of(window, stripe);
    cover.white += more.white;
    cover.yellow += more.yellow;
  };
  switch (paint.marking) {
    case Marking::None:
    case Marking::Rails:
      break;
    case Marking::Center:
      add(strip.broken(0.0, kLine_m, 4.0, 12.0));
      break;
    case Marking::CenterSolid:
      add(strip.solid(0.0, kLine_m));
      break;
    case Marking::Lanes:
      visit_lanes(paint, strip, add);
      break;
    case Marking::Motorway:
      visit_motorway(paint, strip, add);
      break;
    case Marking::Runway:
      cover = runway_marks(paint, window);
      break;
    case Marking::Taxiway:
      add(strip.solid(0.0, kTaxiLine_m, MarkColor::Yellow));
      break;
    case Marking::Crossing:
      add(strip.broken(0.0, 2.0 * paint.half_width_m, kZebraBar_m, 2.0 * kZebraBar_m));
      break;
    case Marking::Stands:
      visit_stands(paint, strip, add);
      break;
  }
  return cover;
}

// Rails 60E1 have heads of 72 mm and feet of 150 mm (EN 13674-1); their inner sides are 1435 mm apart.
// Sleepers B70 are 2.60 m long and 0.30 m wide, 0.60 m apart.
constexpr double kRailHead_m = 0.072;
constexpr double kRailFoot_m = 0.150;
constexpr double kRailCenter_m = 0.5 * (1.435 + kRailHead_m);
constexpr double kSleeperHalf_m = 1.30;
constexpr double kSleeperWidth_m = 0.30;
constexpr double kSleeperSpacing_m = 0.60;

}  // namespace

bool is_marked(const world::PaintSample& paint) {
  return marks_of(paint, Window(paint, 0.0)).share() > 0.0;
}

MarkCover marks_within(const world::PaintSample& paint, double width_m) {
  return marks_of(paint, Window(paint, width_m));
}

core::SemanticClass class_of(const world::PaintSample& paint) {
  return is_marked(paint) ? core::SemanticClass::RoadMarking : paint.coating.semantic_class;
}

TrackCover tracks_within(const world::PaintSample& paint, double width_m) {
  TrackCover cover;
  const Window window(paint, width_m);
  const AlongStrip strip{0.0, paint.whole_m};
  const int num_tracks = std::max<int>(paint.num_lanes, 1);
  double foot = 0.0;
  for (int track = 0; track < num_tracks; ++track) {
    const double center_m = paint.half_width_m * (1.0 - (2.0 * track + 1.0) / num_tracks);
    for (const double side : {-1.0, 1.0}) {
      const double at_m = center_m + side * kRailCenter_m;
      cover.rail += window.share_of(strip.solid(at_m, kRailHead_m));
      foot += window.share_of(strip.solid(at_m, kRailFoot_m));
    }
    cover.sleeper += window.share_of(
        strip.broken(center_m, 2.0 * kSleeperHalf_m, kSleeperWidth_m, kSleeperSpacing_m));
  }
  cover.rail_side = foot - cover.rail;
  return cover;
}

}  // namespace terracast::scene
