#include "validate/evaluate/evaluate_page.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "core/image_io.h"
#include "validate/page_values.h"
#include "validate/report_page.h"

namespace terracast::validate {

namespace {

constexpr const char* kStyle = R"(
:root { --ink:#1d2733; --soft:#5c6b7a; --line:#e3e8ee; --paper:#fff; --ground:#f5f7fa; --ok:#1a8a4f; --bad:#c62f2f; --skip:#8b98a7; --blue:#2b6cb0; }
* { box-sizing:border-box }
body { margin:0 auto; padding:32px 28px 64px; max-width:1180px; background:var(--ground); color:var(--ink);
  font:15px/1.5 system-ui,-apple-system,"Segoe UI","DejaVu Sans",sans-serif }
header { margin-bottom:18px } h1 { margin:0 0 6px; font-size:28px } h2 { margin:36px 0 10px; font-size:20px }
.kind { margin:0; color:var(--soft); letter-spacing:.08em; text-transform:uppercase; font-size:12px }
.about { margin:2px 0; color:var(--soft) }
a { color:inherit; text-decoration:none; border-bottom:1px solid #b9c6d3 } a:hover { color:var(--blue) }
.verdict { display:flex; gap:18px; align-items:baseline; padding:16px 20px; border-radius:10px; color:#fff }
.verdict b { font-size:20px } .verdict.ok { background:var(--ok) } .verdict.bad { background:var(--bad) }
table { width:100%; border-collapse:collapse; background:var(--paper); border-radius:10px; overflow:hidden; box-shadow:0 1px 3px #1d273314 }
th { text-align:left; font-size:12px; color:var(--soft); font-weight:600; background:#eef2f6 }
th,td { padding:7px 12px; border-bottom:1px solid var(--line); vertical-align:top }
td:first-child { white-space:nowrap } .num { text-align:right; font-variant-numeric:tabular-nums; white-space:nowrap }
.worst { color:var(--soft); font-size:13px; max-width:360px; overflow-wrap:anywhere }
tr.bad td { background:#fdf0ef } tr.skip td { color:var(--skip) } tr:last-child td { border-bottom:0 }
.dot { display:inline-block; width:10px; height:10px; border-radius:50%; margin-right:8px; background:var(--skip) }
.dot.ok { background:var(--ok) } .dot.bad { background:var(--bad) }
.bar { display:inline-block; width:90px; height:7px; border-radius:4px; background:#e4e9ef; vertical-align:middle; overflow:hidden }
.bar span { display:block; height:100%; background:var(--ok) } .bar.bad span { background:var(--bad) }
.check { background:var(--paper); border-radius:10px; padding:14px 20px; margin:12px 0; box-shadow:0 1px 3px #1d273314 }
h3 { margin:0 0 4px; font-size:16px } h3 small { float:right; font-weight:400; color:var(--soft) }
p { margin:4px 0 8px } dl { display:grid; grid-template-columns:70px 1fr; margin:6px 0; font-size:13.5px; gap:2px 10px }
dt { color:var(--soft) } dd { margin:0; overflow-wrap:anywhere }
.figures { display:flex; flex-wrap:wrap; gap:14px } figure { margin:8px 0 0 }
figure img { display:block; max-width:100%; height:auto; border-radius:6px } figcaption { font-size:12px; color:var(--soft); max-width:360px }
)";

/// Round values from `least` to `most`, about `count` of them.
std::vector<double> ticks(double least, double most, int count) {
  const double raw = (most - least) / count;
  const double power = std::pow(10.0, std::floor(std::log10(raw)));
  double step = 10.0 * power;
  for (const double factor : {5.0, 2.0, 1.0})
    if (raw <= factor * power) step = factor * power;
  std::vector<double> values;
  const double first = std::ceil(least / step);
  // Counted, not summed: a sum of steps need not advance where the values dwarf the step.
  for (int i = 0; i <= 2 * count && (first + i) * step <= most; ++i)
    values.push_back((first + i) * step + 0.0);  // + 0: never "-0"
  return values;
}

/// The least and the greatest of a plot's values on one axis.
struct Range {
  double least = std::numeric_limits<double>::infinity();
  double most = -std::numeric_limits<double>::infinity();
  void add(double value) {
    least = std::min(least, value);
    most = std::max(most, value);
  }
  /// A twentieth more at both ends; values that all but agree get room as one value does.
  void widen() {
    const double size = std::max(std::abs(least), std::abs(most));
    const double extent = most - least;
    const double margin = extent > 1e-9 * size ? 0.05 * extent : std::max(1e-12, 0.5 * size);
    least -= margin;
    most += margin;
  }
};

}  // namespace

std::string page_head(std::string_view title) {
  return fmt::format(
      "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><meta name=\"viewport\" "
      "content=\"width=device-width\"><title>{}</title><style>{}</style></head><body>\n",
      escaped(title), kStyle);
}

std::string page_end() { return "</body></html>\n"; }

std::string svg_of(const CheckResult::Plot& plot) {
  constexpr double kWidth = 480.0, kHeight = 230.0, kLeft = 62.0, kRight = 14.0, kTop = 28.0,
                   kBottom = 42.0;
  Range x_range, y_range;
  const std::size_t count = std::min(plot.x.size(), plot.y.size());
  // Beyond this no extent is a number.
  constexpr double kFarthest = 1e300;
  const auto is_shown = [&](std::size_t i) {
    return std::abs(plot.x[i]) < kFarthest && std::abs(plot.y[i]) < kFarthest;
  };
  for (std::size_t i = 0; i < count; ++i) {
    if (!is_shown(i)) continue;
    x_range.add(plot.x[i]);
    y_range.add(plot.y[i]);
  }
  if (!(x_range.most >= x_range.least)) return "";
  const bool starts_at_zero = y_range.least >= 0.0 && y_range.least < 0.5 * y_range.most;
  if (starts_at_zero) y_range.least = 0.0;
  x_range.widen();
  y_range.widen();
  if (starts_at_zero) y_range.least = 0.0;
  double scale_x = (kWidth - kLeft - kRight) / (x_range.most - x_range.least);
  double scale_y = (kHeight - kTop - kBottom) / (y_range.most - y_range.least);
  // A map has one scale both ways.
  if (plot.x_label.starts_with("east")) scale_x = scale_y = std::min(scale_x, scale_y);
  const auto px = [&](double x) { return kLeft + (x - x_range.least) * scale_x; };
  const auto py = [&](double y) { return kHeight - kBottom - (y - y_range.least) * scale_y; };
  std::string svg = fmt::format(
      "<svg viewBox=\"0 0 {} {}\" width=\"{}\" height=\"{}\" font-size=\"11\" "
      "font-family=\"system-ui,'DejaVu Sans',sans-serif\">"
      "<text x=\"{}\" y=\"16\" font-size=\"12.5\" font-weight=\"600\" fill=\"#1d2733\">{}</text>",
      kWidth, kHeight, kWidth, kHeight, kLeft, escaped(plot.title));
  const double shown_y = y_range.least + (kHeight - kTop - kBottom) / scale_y;
  for (const double y : ticks(y_range.least, shown_y, 4))
    svg += fmt::format(
        "<line x1=\"{}\" x2=\"{}\" y1=\"{:.1f}\" y2=\"{:.1f}\" stroke=\"#e3e8ee\"/><text x=\"{}\" "
        "y=\"{:.1f}\" text-anchor=\"end\" fill=\"#5c6b7a\">{:.3g}</text>",
        kLeft, kWidth - kRight, py(y), py(y), kLeft - 6.0, py(y) + 3.5, y);
  const double shown_x = x_range.least + (kWidth - kLeft - kRight) / scale_x;
  for (const double x : ticks(x_range.least, shown_x, 6))
    svg += fmt::format(
        "<text x=\"{:.1f}\" y=\"{}\" text-anchor=\"middle\" fill=\"#5c6b7a\">{:.4g}</text>", px(x),
        kHeight - kBottom + 15.0, x);
  svg += fmt::format(
      "<text x=\"{}\" y=\"{}\" text-anchor=\"middle\" fill=\"#5c6b7a\">{}</text><text x=\"14\" "
      "y=\"{}\" text-anchor=\"middle\" "
      "fill=\"#5c6b7a\" transform=\"rotate(-90 14 {})\">{}</text>",
      0.5 * (kLeft + kWidth - kRight), kHeight - 8.0, escaped(plot.x_label),
      0.5 * (kTop + kHeight - kBottom), 0.5 * (kTop + kHeight - kBottom), escaped(plot.y_label));
  std::string points;
  // More points than the plot has columns say nothing more.
  const std::size_t stride = std::max<std::size_t>(1, count / 2000);
  for (std::size_t i = 0; i < count; i += stride)
    if (is_shown(i)) points += fmt::format("{:.1f},{:.1f} ", px(plot.x[i]), py(plot.y[i]));
  svg += fmt::format(
      "<polyline fill=\"none\" stroke=\"#2b6cb0\" stroke-width=\"1.6\" stroke-linejoin=\"round\" "
      "points=\"{}\"/>",
      points);
  if (count <= 200)
    for (std::size_t i = 0; i < count; ++i)
      if (is_shown(i))
        svg += fmt::format("<circle cx=\"{:.1f}\" cy=\"{:.1f}\" r=\"2.3\" fill=\"#2b6cb0\"/>",
                           px(plot.x[i]), py(plot.y[i]));
  return svg + "</svg>";
}

std::string figure(const CheckResult::Picture& picture) {
  return fmt::format(
      "<figure><img src=\"data:image/png;base64,{}\" width=\"{}\" height=\"{}\" "
      "alt=\"{}\"><figcaption>{}</figcaption></figure>\n",
      base64(core::encode_png(picture.image, 6)), picture.image.width(), picture.image.height(),
      escaped(picture.title), escaped(picture.title));
}

}  // namespace terracast::validate
