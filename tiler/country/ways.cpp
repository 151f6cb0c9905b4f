#include "tiler/country/ways.h"

#include <algorithm>
#include <cmath>
#include <tuple>

namespace terracast::tiler::country {
namespace {

constexpr double kTakeCorner_m = 3.0;

constexpr RoadRule kRules[] = {
    {"motorway", 11.5, 0.06, "asphalt", 2, 120},  {"motorway_link", 5.5, 0.08, "asphalt", 1, 60},
    {"primary", 8.5, 0.08, "asphalt", 2, 90},     {"secondary", 7.5, 0.1, "asphalt", 2, 80},
    {"tertiary", 6.5, 0.12, "asphalt", 2, 70},    {"unclassified", 5.5, 0.14, "asphalt", 2, 50},
    {"residential", 6.0, 0.16, "asphalt", 2, 30}, {"pedestrian", 6.0, 0.16, "paving_stones", 1, 10},
    {"service", 4.5, 0.16, "asphalt", 1, 20},     {"track", 3.2, 0.2, "gravel", 1, 20}};

/// Main roads are drawn in short pieces, but in tunnels.
bool is_tunnel(const Way& way, const Point& from, const Point& to) {
  return way.kind == RoadKind::Primary && (to - from).norm() > 200.0;
}

struct Meeting {
  std::size_t segment;
  double share;
  Point at;
};

}  // namespace

const RoadRule& rule_of(RoadKind kind) { return kRules[static_cast<std::size_t>(kind)]; }

void join_at_crossings(std::vector<Way>& ways, double half_size_m) {
  struct Piece {
    std::size_t way, segment;
  };
  std::vector<Piece> pieces;
  PlaceIndex index(half_size_m, 48.0);
  for (std::size_t w = 0; w < ways.size(); ++w) {
    for (Point& point : ways[w].line) point = snapped(point);
    for (std::size_t s = 1; s < ways[w].line.size(); ++s) {
      const Point& a = ways[w].line[s - 1];
      const Point& b = ways[w].line[s];
      index.add(static_cast<std::int32_t>(pieces.size()), a.cwiseMin(b).array() - 0.1,
                a.cwiseMax(b).array() + 0.1);
      pieces.push_back({w, s});
    }
  }
  std::vector<std::vector<Meeting>> meetings(ways.size());
  std::vector<std::int32_t> found;
  for (std::size_t p = 0; p < pieces.size(); ++p) {
    const Point& a = ways[pieces[p].way].line[pieces[p].segment - 1];
    const Point& b = ways[pieces[p].way].line[pieces[p].segment];
    index.find(a.cwiseMin(b).array() - 0.1, a.cwiseMax(b).array() + 0.1, found);
    for (const std::int32_t other : found) {
      const auto q = static_cast<std::size_t>(other);
      if (q <= p) continue;
      if (pieces[q].way == pieces[p].way && pieces[q].segment <= pieces[p].segment + 1) continue;
      const Point& c = ways[pieces[q].way].line[pieces[q].segment - 1];
      const Point& d = ways[pieces[q].way].line[pieces[q].segment];
      const auto note = [&](const Point& at) {
        for (const std::size_t k : {p, q}) {
          const Point& from = ways[pieces[k].way].line[pieces[k].segment - 1];
          const Point along = ways[pieces[k].way].line[pieces[k].segment] - from;
          meetings[pieces[k].way].push_back(
              {pieces[k].segment, (at - from).dot(along) / along.squaredNorm(), at});
        }
      };
      if (a == c || a == d || b == c || b == d) continue;
      // What lies over a tunnel does not meet it.
      if (is_tunnel(ways[pieces[p].way], a, b) || is_tunnel(ways[pieces[q].way], c, d)) continue;
      // Ends that lie on the other line.
      bool is_end = false;
      for (const Point& end : {a, b})
        if (distance_to_segment(end, c, d) < 0.05) note(end), is_end = true;
      for (const Point& end : {c, d})
        if (distance_to_segment(end, a, b) < 0.05) note(end), is_end = true;
      if (is_end) continue;
      const auto share = crossing(a, b, c, d);
      if (!share) continue;
      Point at = a + *share * (b - a);
      double nearest_m = kTakeCorner_m;
      const Point crossing_at = at;
      for (const Point& corner : {a, b, c, d})
        if ((corner - crossing_at).norm() < nearest_m) {
          nearest_m = (corner - crossing_at).norm();
          at = corner;
        }
      note(snapped(at));
    }
  }
  for (std::size_t w = 0; w < ways.size(); ++w) {
    std::sort(meetings[w].begin(), meetings[w].end(), [](const Meeting& a, const Meeting& b) {
      return std::tuple(a.segment, a.share, a.at.x(), a.at.y()) <
             std::tuple(b.segment, b.share, b.at.x(), b.at.y());
    });
    PointsWorld line;
    std::size_t next = 0;
    const auto push = [&](const Point& at) {
      if (line.empty() || line.back() != at) line.push_back(at);
    };
    for (std::size_t s = 0; s < ways[w].line.size(); ++s) {
      while (next < meetings[w].size() && meetings[w][next].segment == s)
        push(meetings[w][next++].at);
      push(ways[w].line[s]);
    }
    ways[w].line = std::move(line);
  }
}

void Barriers::add(const PointsWorld& line, double clear_m) {
  for (std::size_t i = 1; i < line.size(); ++i) {
    index_.add(static_cast<std::int32_t>(pieces_.size()), line[i - 1].cwiseMin(line[i]),
               line[i - 1].cwiseMax(line[i]));
    pieces_.push_back({line[i - 1], line[i], clear_m});
  }
}

double Barriers::room_m(const Point& at, double most_m) const {
  index_.find(at.array() - most_m, at.array() + most_m, found_near_);
  double room_m = most_m;
  for (const std::int32_t index : found_near_) {
    const Piece& piece = pieces_[static_cast<std::size_t>(index)];
    room_m = std::min(room_m, distance_to_segment(at, piece.from, piece.to) - piece.clear_m);
  }
  return room_m;
}

std::vector<StructureSpan> Barriers::spans(const PointsWorld& way) const {
  constexpr double kStep_m = 4.0;
  constexpr double kLongest_m = 300.0;  // to either side
  constexpr double kWidest_m = 64.0;    // no barrier keeps more off
  std::vector<StructureSpan> spans;
  std::vector<double> begins_m{0.0};
  for (std::size_t i = 1; i < way.size(); ++i)
    begins_m.push_back(begins_m.back() + (way[i] - way[i - 1]).norm());
  const auto at = [&](double along_m) {
    const auto after = std::upper_bound(begins_m.begin() + 1, begins_m.end() - 1, along_m);
    const auto i = static_cast<std::size_t>(after - begins_m.begin());
    const double t = (along_m - begins_m[i - 1]) / std::max(begins_m[i] - begins_m[i - 1], 1e-6);
    return Point(way[i - 1] + t * (way[i] - way[i - 1]));
  };
  for (std::size_t i = 1; i < way.size(); ++i) {
    index_.find(way[i - 1].cwiseMin(way[i]), way[i - 1].cwiseMax(way[i]), found_);
    for (const std::int32_t index : found_) {
      const Piece& piece = pieces_[static_cast<std::size_t>(index)];
      const auto share = crossing(way[i - 1], way[i], piece.from, piece.to);
      if (!share) continue;
      // To where it has left what it crosses.
      const double middle_m = begins_m[i - 1] + *share * (begins_m[i] - begins_m[i - 1]);
      double from_m = middle_m - piece.clear_m, to_m = middle_m + piece.clear_m;
      while (from_m > 0.0 && from_m > middle_m - kLongest_m && room_m(at(from_m), kWidest_m) < 0.0)
        from_m -= kStep_m;
      while (to_m < begins_m.back() && to_m < middle_m + kLongest_m &&
             room_m(at(to_m), kWidest_m) < 0.0)
        to_m += kStep_m;
      spans.push_back({from_m, to_m, false});
    }
  }
  return spans;
}

bool Barriers::has_piece(const Point& from, const Point& to) const {
  index_.find(from.cwiseMin(to), from.cwiseMax(to), found_);
  return std::any_of(found_.begin(), found_.end(), [&](std::int32_t index) {
    const Piece& piece = pieces_[static_cast<std::size_t>(index)];
    return distance_to_segment(from, piece.from, piece.to) < 0.5 &&
           distance_to_segment(to, piece.from, piece.to) < 0.5;
  });
}

std::vector<StructureSpan> merged(std::vector<StructureSpan> spans, double length_m) {
  std::sort(spans.begin(), spans.end(), [](const StructureSpan& a, const StructureSpan& b) {
    return std::tuple(a.from_m, a.to_m) < std::tuple(b.from_m, b.to_m);
  });
  std::vector<StructureSpan> result;
  for (StructureSpan span : spans) {
    span.from_m = std::max(span.from_m, 0.0);
    span.to_m = std::min(span.to_m, length_m);
    if (span.to_m - span.from_m < 2.0) continue;
    if (!result.empty() && span.from_m < result.back().to_m + 30.0) {
      result.back().to_m = std::max(result.back().to_m, span.to_m);
      result.back().is_tunnel = result.back().is_tunnel && span.is_tunnel;
    } else {
      result.push_back(span);
    }
  }
  return result;
}

void add_spanned_line(Survey& survey, Theme theme, const PointsWorld& line,
                      const std::vector<StructureSpan>& spans, const Tags& tags) {
  const double length_m = length_of(line);
  double done_m = 0.0;
  for (const StructureSpan& span : spans) {
    if (span.from_m > done_m + 1.0)
      survey.add_line(theme, part_of(line, done_m, span.from_m), tags);
    Tags own = tags;
    own.emplace_back(span.is_tunnel ? "tunnel" : "bridge", "yes");
    own.emplace_back("layer", span.is_tunnel ? "-1" : "1");
    survey.add_line(theme,
                    part_of(line, span.from_m > done_m + 1.0 ? span.from_m : done_m, span.to_m),
                    std::move(own));
    done_m = span.to_m;
  }
  if (spans.empty())
    survey.add_line(theme, line, tags);
  else if (length_m > done_m + 1e-6)
    survey.add_line(theme, part_of(line, done_m, length_m), tags);
}

}  // namespace terracast::tiler::country
