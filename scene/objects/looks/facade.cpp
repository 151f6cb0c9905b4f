#include "scene/objects/looks/facade.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <span>

#include "scene/ground/pattern.h"
#include "scene/objects/looks/families.h"
#include "world/facade.h"

namespace terracast::scene {
namespace {

using world::FacadeStyle;
constexpr std::size_t kNumStyles = 9;

/// Shares of a wall about a place, 1 together.
struct Mix {
  float wall = 1.0f;
  float trim = 0.0f;    ///< frames, sills, bands
  float accent = 0.0f;  ///< doors, gates, shutters, signs
  float dark = 0.0f;    ///< reveals and what lies in the shadow of slabs
  float glass = 0.0f;
  float curtain = 0.0f;  ///< behind glass

  static void move(float& from, float& to, double share) {
    from -= static_cast<float>(share);
    to += static_cast<float>(share);
  }
  void mix(float share, const Mix& other) {
    for (const auto part :
         {&Mix::wall, &Mix::trim, &Mix::accent, &Mix::dark, &Mix::glass, &Mix::curtain})
      this->*part += share * (other.*part - this->*part);
  }
};

/// A place in the cell of a bay and a storey, in shares of it, with the sides of the window that a
/// sample averages over. Cells beside are taken to be alike, so that nothing is lost at borders.
struct CellPlace {
  double x;
  double y;
  double width_x;
  double width_y;
  double bay_m;
  double storey_m;

  double share_x(double from, double to) const {
    return share_of_bars(x - from, width_x, to - from, 1.0);
  }
  double share_y(double from, double to) const {
    return share_of_bars(y - from, width_y, to - from, 1.0);
  }
  double share(double x0, double x1, double y0, double y1) const {
    return share_x(x0, x1) * share_y(y0, y1);
  }
};

/// What is asked of the draw of a cell: numbers of [0, 1).
struct CellDraw {
  float kind;
  float column;  ///< the same in all storeys of a bay
  float curtain;
  float closed;
};

/// A hole in the wall, a frame in it, panes in the frame, curtains behind them.
void put_window(const CellPlace& at, const CellDraw& draw, double x0, double x1, double y0,
                double y1, int panes, Mix& mix) {
  const double frame_x = 0.07 / at.bay_m;
  const double frame_y = 0.07 / at.storey_m;
  Mix::move(mix.wall, mix.trim, at.share(x0, x1, y0, y1));
  // The lintel's shadow lies on the frame.
  Mix::move(mix.trim, mix.dark, at.share(x0, x1, y1 - frame_y, y1));
  const double pane_x0 = x0 + frame_x;
  const double pane_x1 = x1 - frame_x;
  const double pane_y0 = y0 + frame_y;
  const double pane_y1 = y1 - frame_y;
  const double bar_x = 0.05 / at.bay_m;
  const double step = (pane_x1 - pane_x0 + bar_x) / panes;
  const double high = at.share_y(pane_y0, pane_y1);
  const double curtain_y = pane_y1 - (pane_y1 - pane_y0) * static_cast<double>(draw.curtain);
  const double hung = draw.curtain > 0.0f ? at.share_y(curtain_y, pane_y1) : 0.0;
  for (int i = 0; i < panes; ++i) {
    const double wide = at.share_x(pane_x0 + i * step, pane_x0 + (i + 1) * step - bar_x);
    Mix::move(mix.trim, mix.glass, wide * high);
    Mix::move(mix.glass, mix.curtain, wide * hung);
  }
  // A sill stands out and throws a shadow.
  const double sill_y = 0.06 / at.storey_m;
  Mix::move(mix.wall, mix.trim, at.share(x0 - frame_x, x1 + frame_x, y0 - sill_y, y0));
  Mix::move(mix.wall, mix.dark,
            0.6 * at.share(x0 - frame_x, x1 + frame_x, y0 - 2.0 * sill_y, y0 - sill_y));
}

void put_door(const CellPlace& at, double x0, double x1, double y1, Mix& mix) {
  const double frame_x = 0.10 / at.bay_m;
  const double frame_y = 0.10 / at.storey_m;
  Mix::move(mix.wall, mix.trim, at.share(x0, x1, 0.0, y1));
  const double leaf = at.share(x0 + frame_x, x1 - frame_x, 0.0, y1 - frame_y);
  Mix::move(mix.trim, mix.accent, leaf);
  // A light in its upper third.
  Mix::move(mix.accent, mix.glass,
            at.share(x0 + 2.5 * frame_x, x1 - 2.5 * frame_x, 0.68 * y1, y1 - 2.0 * frame_y));
}

void put_gate(const CellPlace& at, double x0, double x1, double y1, Mix& mix) {
  Mix::move(mix.wall, mix.accent, at.share(x0, x1, 0.0, y1));
  // Its slats, and the lintel's shadow.
  const double slat = 0.45 / at.storey_m;
  const double gap = 0.03 / at.storey_m;
  const int slats = std::max(static_cast<int>(y1 / slat), 1);
  for (int i = 1; i < std::min(slats, 12); ++i)
    Mix::move(mix.accent, mix.dark, 0.7 * at.share(x0, x1, i * slat - gap, i * slat));
  Mix::move(mix.accent, mix.dark, 0.8 * at.share(x0, x1, y1 - 2.0 * gap, y1));
}

/// Curtains hang in a third of the windows.
CellDraw with_curtain(CellDraw draw, float share) {
  draw.curtain = draw.curtain < share ? 0.25f + 0.75f * draw.curtain / share : 0.0f;
  return draw;
}

void put_dwelling(const CellPlace& at, CellDraw draw, bool is_ground, bool has_shutters, Mix& mix) {
  draw = with_curtain(draw, 0.40f);
  if (is_ground && draw.kind < 0.13f) {
    put_door(at, 0.31, 0.66, 0.74, mix);
    return;
  }
  if (draw.column > 0.86f) return;  // a blank bay
  constexpr double kLow = 0.33;
  constexpr double kHigh = 0.80;
  if (draw.kind > 0.93f) {  // a small one
    put_window(at, draw, 0.39, 0.60, 0.50, kHigh, 1, mix);
    return;
  }
  constexpr double kLeft = 0.32;
  constexpr double kRight = 0.68;
  put_window(at, draw, kLeft, kRight, kLow, kHigh, 2, mix);
  if (!has_shutters) return;
  if (draw.closed < 0.10f) {
    const double shut = at.share(kLeft, kRight, kLow, kHigh);
    const float open = 1.0f - static_cast<float>(shut);
    mix.trim *= open;  // nothing of the window is seen through the shutters
    mix.glass *= open;
    mix.curtain *= open;
    mix.dark *= open;
    mix.accent += 1.0f - (mix.wall + mix.trim + mix.accent + mix.dark + mix.glass + mix.curtain);
    return;
  }
  const double side = 0.47 * (kRight - kLeft);
  for (const double x0 : {kLeft - side - 0.01, kRight + 0.01})
    Mix::move(mix.wall, mix.accent, at.share(x0, x0 + side, kLow, kHigh));
}

void put_apartment(const CellPlace& at, CellDraw draw, bool is_ground, Mix& mix) {
  draw = with_curtain(draw, 0.45f);
  if (is_ground && draw.kind < 0.10f) {
    put_door(at, 0.26, 0.70, 0.78, mix);
    return;
  }
  if (draw.column < 0.42f && !is_ground) {
    // A balcony: glass doors, a railing in front, the slab above.
    put_window(at, draw, 0.14, 0.84, 0.07, 0.82, 3, mix);
    const double slab_y = 0.18 / at.storey_m;
    const double slab = at.share(0.06, 0.94, 1.0 - slab_y, 1.0);
    Mix::move(mix.wall, mix.trim, slab);
    const double shadow = at.share(0.06, 0.94, 0.82 + 0.01, 1.0 - slab_y);
    Mix::move(mix.wall, mix.dark, 0.7 * shadow);
    const auto rail = static_cast<float>(0.62 * at.share(0.06, 0.94, 0.0, 0.36));
    const float kept = 1.0f - rail;
    mix.wall *= kept;
    mix.trim *= kept;
    mix.dark *= kept;
    mix.glass *= kept;
    mix.curtain *= kept;
    mix.accent = mix.accent * kept + rail;
    return;
  }
  put_window(at, draw, 0.26, 0.74, 0.32, 0.80, 2, mix);
}

void put_shop(const CellPlace& at, const CellDraw& draw, Mix& mix) {
  CellDraw bare = draw;
  bare.curtain = 0.0f;
  if (draw.kind < 0.16f)  // a glass door
    put_window(at, bare, 0.32, 0.68, 0.0, 0.72, 2, mix);
  else
    put_window(at, bare, 0.05, 0.95, 0.13, 0.72, 2, mix);
  Mix::move(mix.wall, mix.accent, at.share(0.0, 1.0, 0.76, 0.94));
}

void put_hall(const CellPlace& at, const CellDraw& draw, bool is_ground, Mix& mix) {
  Mix::move(mix.wall, mix.glass, at.share(0.02, 0.98, 0.84, 0.94));
  if (!is_ground) return;
  const double high = std::min(4.2 / at.storey_m, 0.78);
  if (draw.column < 0.30f)
    put_gate(at, 0.14, 0.86, high, mix);
  else if (draw.column < 0.42f)
    put_door(at, 0.42, 0.42 + 1.1 / at.bay_m, std::min(2.1 / at.storey_m, 0.78), mix);
}

/// A tall window with a round arch.
void put_church_window(const CellPlace& at, Mix& mix) {
  constexpr double kLeft = 0.36;
  constexpr double kRight = 0.64;
  constexpr double kLow = 0.24;
  const double radius_m = 0.5 * (kRight - kLeft) * at.bay_m;
  const double top = 0.84;
  const double spring = std::max(top - radius_m / at.storey_m, kLow + 0.1);
  const auto opening = [&](double margin_m) {
    const double margin_x = margin_m / at.bay_m;
    const double body =
        at.share(kLeft + margin_x, kRight - margin_x, kLow + margin_m / at.storey_m, spring);
    // The arch in four steps, each as wide as in its middle.
    double arch = 0.0;
    for (int i = 0; i < 4; ++i) {
      const double height = (i + 0.5) / 4.0;
      const double half = (radius_m - margin_m) * std::sqrt(1.0 - height * height) / at.bay_m;
      const double step = (top - spring) * (radius_m - margin_m) / radius_m / 4.0;
      arch += at.share(0.5 - half, 0.5 + half, spring + i * step, spring + (i + 1) * step);
    }
    return body + arch;
  };
  Mix::move(mix.wall, mix.trim, opening(0.0));
  const double pane = opening(0.14);
  Mix::move(mix.trim, mix.glass, pane);
  Mix::move(mix.glass, mix.dark, 0.25 * pane);  // lead
}

Mix cell_mix(FacadeStyle style, const CellPlace& at, const CellDraw& draw, bool is_ground) {
  Mix mix;
  switch (style) {
    case FacadeStyle::House:
      put_dwelling(at, draw, is_ground, false, mix);
      break;
    case FacadeStyle::Shutters:
      put_dwelling(at, draw, is_ground, true, mix);
      break;
    case FacadeStyle::Apartments:
      put_apartment(at, draw, is_ground, mix);
      break;
    case FacadeStyle::Shops:
      if (is_ground)
        put_shop(at, draw, mix);
      else
        put_dwelling(at, draw, false, false, mix);
      break;
    case FacadeStyle::Offices: {
      const CellDraw blinds = with_curtain(draw, 0.35f);
      put_window(at, blinds, 0.0, 1.0, is_ground ? 0.12 : 0.30, 0.84, 1, mix);
      break;
    }
    case FacadeStyle::CurtainWall: {
      const CellDraw blinds = with_curtain(draw, 0.25f);
      put_window(at, blinds, 0.0, 1.0, 0.02, 1.0, 1, mix);
      // Storeys' floors stand behind.
      const double floors = at.share_y(0.05, 0.20) * at.share_x(0.05, 0.95);
      const double behind = std::min(static_cast<double>(mix.glass), 0.6 * floors);
      Mix::move(mix.glass, mix.dark, behind);
      break;
    }
    case FacadeStyle::Hall:
      put_hall(at, draw, is_ground, mix);
      break;
    case FacadeStyle::Church:
      if (is_ground) put_church_window(at, mix);
      break;
    case FacadeStyle::Garage:
      if (is_ground) put_gate(at, 0.07, 0.93, std::min(2.15 / at.storey_m, 0.85), mix);
      break;
  }
  return mix;
}

double mean_storey_m(FacadeStyle style) {
  if (style == FacadeStyle::Hall || style == FacadeStyle::Church) return 7.0;
  return style == FacadeStyle::Offices || style == FacadeStyle::CurtainWall ? 3.4 : 3.0;
}

CellDraw draw_of(std::uint64_t seed, double column, double row) {
  const std::uint64_t bits =
      core::random_bits(seed, static_cast<std::uint64_t>(static_cast<std::int64_t>(column)),
                        static_cast<std::uint64_t>(static_cast<std::int64_t>(row)));
  const auto part = [bits](int shift) {
    return static_cast<float>((bits >> shift) & 0xffffu) * 0x1.0p-16f;
  };
  return {.kind = part(0),
          .column = cell_tint(seed, column, -77.0),
          .curtain = part(16),
          .closed = part(32)};
}

/// What each style mixes to over many of its cells, at the foot and above.
struct MeanMixes {
  std::array<std::array<Mix, 2>, kNumStyles> mix;
};

MeanMixes average_cells() {
  constexpr int kPlaces = 12;
  constexpr int kCells = 600;
  MeanMixes means;
  for (std::size_t style = 0; style < kNumStyles; ++style) {
    for (std::size_t is_ground = 0; is_ground < 2; ++is_ground) {
      std::array<double, 6> sums{};
      const auto name = static_cast<FacadeStyle>(style);
      for (int cell = 0; cell < kCells; ++cell) {
        // One window of a whole cell is the cell's mean.
        const CellPlace at{.x = 0.5,
                           .y = 0.5,
                           .width_x = 1.0,
                           .width_y = 1.0,
                           .bay_m = world::facade_bay_m(name),
                           .storey_m = mean_storey_m(name)};
        const Mix one = cell_mix(name, at, draw_of(4711, cell / kPlaces, cell), is_ground == 1);
        const std::array<float, 6> parts = {one.wall, one.trim,  one.accent,
                                            one.dark, one.glass, one.curtain};
        for (std::size_t k = 0; k < 6; ++k) sums[k] += static_cast<double>(parts[k]) / kCells;
      }
      means.mix[style][is_ground] = {static_cast<float>(sums[0]), static_cast<float>(sums[1]),
                                     static_cast<float>(sums[2]), static_cast<float>(sums[3]),
                                     static_cast<float>(sums[4]), static_cast<float>(sums[5])};
    }
  }
  return means;
}

/// Colours that a building's joiners and painters chose.
Rgb pick(const ObjectPlace& place, std::uint64_t question, std::span<const Rgb> colors) {
  const auto row =
      static_cast<std::size_t>(object_tint(place, question) * static_cast<float>(colors.size()));
  return colors[std::min(row, colors.size() - 1)];
}

constexpr std::array<Rgb, 6> kTrims = {Rgb{0.70f, 0.70f, 0.68f},    Rgb{0.62f, 0.61f, 0.57f},
                                       Rgb{0.68f, 0.67f, 0.64f},    Rgb{0.14f, 0.09f, 0.055f},
                                       Rgb{0.055f, 0.058f, 0.062f}, Rgb{0.34f, 0.34f, 0.34f}};
constexpr std::array<Rgb, 7> kShutters = {Rgb{0.055f, 0.095f, 0.050f}, Rgb{0.120f, 0.062f, 0.033f},
                                          Rgb{0.075f, 0.110f, 0.150f}, Rgb{0.170f, 0.035f, 0.028f},
                                          Rgb{0.450f, 0.440f, 0.410f}, Rgb{0.240f, 0.235f, 0.220f},
                                          Rgb{0.160f, 0.105f, 0.060f}};
constexpr std::array<Rgb, 6> kGates = {Rgb{0.42f, 0.42f, 0.41f}, Rgb{0.25f, 0.26f, 0.27f},
                                       Rgb{0.52f, 0.51f, 0.48f}, Rgb{0.06f, 0.10f, 0.19f},
                                       Rgb{0.16f, 0.10f, 0.06f}, Rgb{0.24f, 0.045f, 0.035f}};
constexpr std::array<Rgb, 8> kSigns = {Rgb{0.230f, 0.045f, 0.040f}, Rgb{0.050f, 0.080f, 0.160f},
                                       Rgb{0.060f, 0.060f, 0.065f}, Rgb{0.060f, 0.120f, 0.070f},
                                       Rgb{0.460f, 0.450f, 0.430f}, Rgb{0.300f, 0.220f, 0.080f},
                                       Rgb{0.300f, 0.290f, 0.270f}, Rgb{0.160f, 0.120f, 0.090f}};

Rgb accent_of(const ObjectPlace& place, FacadeStyle style, double column, bool is_ground,
              float seen) {
  switch (style) {
    case FacadeStyle::Shops: {
      if (!is_ground) return pick(place, 41, kShutters);
      Rgb mean{0.202f, 0.173f, 0.146f};  // of kSigns
      // A shop takes two bays or three.
      const auto row = static_cast<std::size_t>(
          cell_tint(place.seed ^ 71, std::floor(column / 2.5), 0.0) * kSigns.size());
      lay(mean, seen, kSigns[std::min(row, kSigns.size() - 1)]);
      return mean;
    }
    case FacadeStyle::Hall:
    case FacadeStyle::Garage:
      return pick(place, 42, kGates);
    case FacadeStyle::Apartments:
      return pick(place, 43, kGates);
    default:
      return pick(place, 41, kShutters);
  }
}

}  // namespace

void lay_facade(const ObjectPlace& place, ObjectLook& look) {
  const std::uint16_t pattern = place.finish.pattern;
  const bool is_glass = place.finish.material == world::Material::GlassFacade;
  if (!is_glass && (pattern == 0 || !place.has_uv)) return;
  const auto style =
      pattern == 0
          ? FacadeStyle::CurtainWall
          : static_cast<FacadeStyle>(std::min<std::uint16_t>(pattern >> 8, kNumStyles - 1));
  const double storey_m = std::max(0.1 * (pattern == 0 ? 34 : pattern & 255), 1.8);
  const double bay_m = world::facade_bay_m(style);
  const auto width_m = static_cast<double>(place.footprint_m);
  if (place.v_m < -0.5 * width_m) return;  // below the ground's highest side: plinth

  static const MeanMixes means = average_cells();
  const double column = std::floor(place.u_m / bay_m);
  const double row = std::max(std::floor(place.v_m / storey_m), 0.0);
  const bool is_ground = row == 0.0;
  const CellDraw draw = draw_of(place.seed, column, row);
  const CellPlace at{.x = place.u_m / bay_m - column,
                     .y = place.v_m / storey_m - row,
                     .width_x = width_m / bay_m,
                     .width_y = width_m / storey_m,
                     .bay_m = bay_m,
                     .storey_m = storey_m};
  const auto cell_m = static_cast<float>(std::min(bay_m, storey_m));
  const float seen = told(place.footprint_m, cell_m);
  Mix mix;
  if (seen > 0.0f) mix = cell_mix(style, at, draw, is_ground);
  if (seen < 1.0f) {
    const std::array<Mix, 2>& mean = means.mix[static_cast<std::size_t>(style)];
    Mix far = mean[0];
    far.mix(static_cast<float>(share_within(place.v_m, std::max(width_m, 1e-3), 0.0, storey_m)),
            mean[1]);
    mix.mix(1.0f - seen, far);
  }

  const Rgb trim = pick(place, 44, kTrims);
  const Rgb accent = accent_of(place, style, column, is_ground, seen);
  // Rooms are dark by day, not all alike; curtains and blinds are light.
  const float room = 0.018f + 0.030f * (0.5f + seen * (draw.kind - 0.5f));
  // Through coated glass less of them is seen.
  const float cloth = (is_glass ? 0.10f : 0.28f) * (1.0f + 0.8f * seen * (draw.closed - 0.5f));
  const Rgb wall = look.albedo;
  const Rgb behind = is_glass
                         ? Rgb{0.25f * place.color.r, 0.25f * place.color.g, 0.25f * place.color.b}
                         : Rgb{room, room, room * 1.1f};
  const auto add = [&](float share, const Rgb& color) {
    look.albedo.r += share * color.r;
    look.albedo.g += share * color.g;
    look.albedo.b += share * color.b;
  };
  look.albedo = {0.0f, 0.0f, 0.0f};
  add(mix.wall, wall);
  add(mix.trim, trim);
  add(mix.accent, accent);
  add(mix.dark, {0.022f, 0.022f, 0.024f});
  add(mix.glass, behind);
  add(mix.curtain, {cloth, 0.96f * cloth, 0.88f * cloth});

  const float pane = mix.glass + mix.curtain;
  // No two panes hang quite alike.
  const float tilt = 0.012f * seen;
  if (pane > look.gloss.share) {
    look.gloss = {.share = clamped(pane, 0.0f, 1.0f),
                  .facing = {0.075f, 0.078f, 0.080f},
                  .roughness = 0.03f + 0.06f * (1.0f - seen),
                  .normal = bent(place, tilt * (draw.kind - 0.5f), tilt * (draw.closed - 0.5f))};
    if (is_glass) look.gloss.facing = {0.16f, 0.165f, 0.17f};  // coated against the sun
  }
  const float lit = 0.22f + seen * ((draw.closed > 0.78f ? 1.0f : 0.0f) - 0.22f);
  const float light = 0.22f * lit * pane;
  look.emitted_by_night = {light, 0.72f * light, 0.40f * light};
}

}  // namespace terracast::scene
