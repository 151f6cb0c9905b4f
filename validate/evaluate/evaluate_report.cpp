#include "validate/evaluate/evaluate_report.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <iterator>

#include "core/atomic_file.h"
#include "validate/evaluate/evaluate_page.h"
#include "validate/report_page.h"

namespace terracast::validate {

namespace {

using core::Json;

/// "EPE2D, px".
std::string heading(const Measure& measure) {
  return measure.unit.empty() ? measure.name : measure.name + ", " + measure.unit;
}

std::string shown(const std::optional<double>& value) {
  if (!value) return "–";
  return fmt::format("{:.{}f}", *value, std::abs(*value) < 100.0 ? 4 : 2);
}

double share_percent(std::int64_t part, std::int64_t whole) {
  return whole > 0 ? 100.0 * static_cast<double>(part) / static_cast<double>(whole) : 0.0;
}

/// Whether a frame is a pixel: then shares of pixels say nothing.
bool has_pixels(const Evaluation& evaluation) {
  return evaluation.task != "trajectory" && evaluation.task != "cloud";
}

std::vector<std::string> headings(const Evaluation& evaluation) {
  std::vector<std::string> words{"sequence", "camera", "frames"};
  if (has_pixels(evaluation)) words.emplace_back("answered");
  for (const Measure& measure : evaluation.measures) words.push_back(heading(measure));
  return words;
}

std::vector<std::string> cells(const Evaluation& evaluation, const ScoreRow& row) {
  std::vector<std::string> words{row.sequence, row.camera,
                                 fmt::format("{}/{}", row.num_answered_frames, row.num_frames)};
  // Rounded down: what is not complete does not look so.
  if (has_pixels(evaluation))
    words.push_back(fmt::format(
        "{:.2f} %", std::floor(100.0 * share_percent(row.num_answered, row.num_truth)) / 100.0));
  for (const std::optional<double>& value : row.values) words.push_back(shown(value));
  return words;
}

/// Columns as wide in text as they are long in letters, not bytes.
std::size_t length_of(const std::string& text) {
  return static_cast<std::size_t>(
      std::count_if(text.begin(), text.end(), [](char c) { return (c & 0xC0) != 0x80; }));
}

Json values_json(const std::vector<Measure>& measures,
                 const std::vector<std::optional<double>>& values) {
  Json json = Json::object();
  for (std::size_t i = 0; i < measures.size(); ++i)
    json.set(measures[i].name, values[i] && std::isfinite(*values[i]) ? Json(*values[i]) : Json());
  return json;
}

Json row_json(const Evaluation& evaluation, const ScoreRow& row) {
  return Json::object()
      .set("sequence", row.sequence)
      .set("camera", row.camera)
      .set("frames", row.num_frames)
      .set("answered_frames", row.num_answered_frames)
      .set("truth", row.num_truth)
      .set("answered", row.num_answered)
      .set("values", values_json(evaluation.measures, row.values));
}

std::vector<std::optional<double>> values_of(const Evaluation& evaluation,
                                             const FrameScore& frame) {
  std::vector<std::optional<double>> values;
  for (std::size_t i = 0; i < evaluation.measures.size(); ++i)
    values.push_back(figure_of(evaluation.measures[i], i, {&frame}, Averaging::Pixels));
  return values;
}

Json subject_json(const Evaluation& evaluation, const SubjectScore& subject) {
  Json frames = Json::array();
  for (const FrameScore& frame : subject.frames) {
    Json json = Json::object();
    if (subject.row_times_s.empty())
      json.set("frame", frame.frame);
    else
      json.set("time_s", subject.row_times_s[static_cast<std::size_t>(frame.frame)]);
    frames.push(json.set("is_answered", frame.is_answered)
                    .set("truth", frame.num_truth)
                    .set("answered", frame.num_answered)
                    .set("values", values_json(evaluation.measures, values_of(evaluation, frame))));
  }
  Json found = Json::object();
  for (const auto& [name, value] : subject.found) found.set(name, value);
  return Json::object()
      .set("sequence", subject.sequence)
      .set("camera", subject.camera)
      .set("found", found)
      .set("frames", frames);
}

std::string table_html(const Evaluation& evaluation) {
  std::string html = "<table><thead><tr>";
  for (const std::string& word : headings(evaluation))
    html += fmt::format("<th>{}</th>", escaped(word));
  html += "</tr></thead><tbody>\n";
  for (const ScoreRow& row : evaluation.rows) {
    html += "<tr>";
    for (const std::string& word : cells(evaluation, row))
      html += fmt::format("<td>{}</td>", escaped(word));
    html += "</tr>\n";
  }
  return html + "</tbody></table>\n";
}

/// Paths on one map, to one scale both ways; the first is the truth.
std::string map_svg(const std::vector<CheckResult::Plot>& paths) {
  constexpr double kSide = 420.0, kMargin = 46.0;
  static constexpr const char* kColors[] = {"#1d2733", "#c62f2f"};
  Eigen::AlignedBox2d box;
  for (const CheckResult::Plot& path : paths)
    for (std::size_t i = 0; i < path.x.size(); ++i)
      box.extend(Eigen::Vector2d(path.x[i], path.y[i]));
  if (box.isEmpty()) return "";
  const double extent_m = std::max(box.sizes().maxCoeff(), 1e-6);
  const double scale = (kSide - 2.0 * kMargin) / extent_m;
  // A round length of about a third of the map, for its scale.
  const double power = std::pow(10.0, std::floor(std::log10(extent_m / 3.0)));
  const double share = extent_m / 3.0 / power;
  const double bar_m = power * (share >= 5.0 ? 5.0 : share >= 2.0 ? 2.0 : 1.0);
  std::string svg = fmt::format(
      "<svg viewBox=\"0 0 {0} {0}\" width=\"{0}\" height=\"{0}\" font-size=\"11\" "
      "font-family=\"system-ui,'DejaVu Sans',sans-serif\"><text x=\"{1}\" y=\"16\" "
      "font-size=\"12.5\" font-weight=\"600\" fill=\"#1d2733\">Seen from above, north up</text>",
      kSide, kMargin);
  svg += fmt::format(
      "<line x1=\"{0}\" x2=\"{1:.1f}\" y1=\"{2}\" y2=\"{2}\" stroke=\"#5c6b7a\" "
      "stroke-width=\"3\"/><text x=\"{0}\" y=\"{3}\" fill=\"#5c6b7a\">{4:.3g} m</text>",
      kMargin, kMargin + bar_m * scale, kSide - 26.0, kSide - 10.0, bar_m);
  for (std::size_t k = 0; k < paths.size(); ++k) {
    const char* const color = kColors[std::min(k, std::size(kColors) - 1)];
    svg +=
        fmt::format("<text x=\"{}\" y=\"{}\" fill=\"{}\">{}</text>", kSide - 170.0,
                    kSide - 26.0 + 16.0 * static_cast<double>(k), color, escaped(paths[k].title));
    std::string points;
    for (std::size_t i = 0; i < paths[k].x.size(); ++i)
      points += fmt::format("{:.2f},{:.2f} ", kMargin + (paths[k].x[i] - box.min().x()) * scale,
                            kSide - kMargin - (paths[k].y[i] - box.min().y()) * scale);
    svg += fmt::format(
        "<polyline fill=\"none\" stroke=\"{}\" stroke-width=\"{}\" stroke-linejoin=\"round\" "
        "points=\"{}\"/>",
        color, k == 0 ? 3.0 : 1.4, points);
  }
  return svg + "</svg>";
}

std::string plots_html(const Evaluation& evaluation, const SubjectScore& subject) {
  std::string html = "<div class=\"figures\">\n";
  std::vector<double> shown_before;
  for (std::size_t i = 0; i < evaluation.measures.size(); ++i) {
    const bool has_rows = !subject.row_times_s.empty();
    CheckResult::Plot plot{
        .title = evaluation.measures[i].name + (has_rows ? " over the rows" : " over the frames"),
        .x_label = has_rows ? "time, s" : "frame",
        .y_label = heading(evaluation.measures[i]),
        .x = {},
        .y = {}};
    for (const FrameScore& frame : subject.frames)
      if (const auto value = values_of(evaluation, frame)[i]) {
        plot.x.push_back(has_rows ? subject.row_times_s[static_cast<std::size_t>(frame.frame)]
                                  : frame.frame);
        plot.y.push_back(*value);
      }
    // Of one pose a root of the mean square is the mean: one curve is enough.
    if (plot.x.size() < 2 || plot.y == shown_before) continue;
    shown_before = plot.y;
    html += "<figure>" + svg_of(plot) + "</figure>\n";
  }
  for (const CheckResult::Plot& curve : subject.curves)
    html += "<figure>" + svg_of(curve) + "</figure>\n";
  if (!subject.plots.empty()) html += "<figure>" + map_svg(subject.plots) + "</figure>\n";
  return html + "</div>\n";
}

}  // namespace

std::optional<double> figure_of(const Measure& measure, std::size_t index,
                                const std::vector<const FrameScore*>& frames, Averaging averaging) {
  const auto finished = [&](const Sum& sum) {
    const double mean = sum.total / static_cast<double>(sum.count);
    return measure.is_root ? std::sqrt(mean) : mean;
  };
  Sum all;
  for (const FrameScore* const frame : frames) {
    if (frame->sums.empty() || frame->sums[index].count == 0) continue;
    if (averaging == Averaging::Frames) {
      all.total += finished(frame->sums[index]);
      ++all.count;
    } else {
      all.total += frame->sums[index].total;
      all.count += frame->sums[index].count;
    }
  }
  if (all.count == 0) return std::nullopt;
  return averaging == Averaging::Frames ? all.total / static_cast<double>(all.count)
                                        : finished(all);
}

std::string table_text(const Evaluation& evaluation) {
  std::vector<std::vector<std::string>> lines{headings(evaluation)};
  for (const ScoreRow& row : evaluation.rows) lines.push_back(cells(evaluation, row));
  std::vector<std::size_t> widths(lines.front().size());
  for (const auto& line : lines)
    for (std::size_t i = 0; i < line.size(); ++i)
      widths[i] = std::max(widths[i], length_of(line[i]));
  std::string text = fmt::format("{} of {}; {}\n", evaluation.task, evaluation.title,
                                 fmt::join(evaluation.terms, ", "));
  for (const auto& line : lines) {
    for (std::size_t i = 0; i < line.size(); ++i) {
      const std::string pad(widths[i] - length_of(line[i]), ' ');
      // Names to the left, figures to the right.
      text += (i < 2 ? line[i] + pad : pad + line[i]) + (i + 1 < line.size() ? "  " : "\n");
    }
  }
  for (const std::string& note : evaluation.notes) text += note + "\n";
  return text;
}

Json evaluation_json(const Evaluation& evaluation) {
  Json measures = Json::array();
  for (const Measure& measure : evaluation.measures)
    measures.push(Json::object()
                      .set("name", measure.name)
                      .set("unit", measure.unit)
                      .set("is_higher_better", measure.is_higher_better));
  Json rows = Json::array();
  for (const ScoreRow& row : evaluation.rows) rows.push(row_json(evaluation, row));
  Json subjects = Json::array();
  for (const SubjectScore& subject : evaluation.subjects)
    subjects.push(subject_json(evaluation, subject));
  return Json::object()
      .set("task", evaluation.task)
      .set("truth", evaluation.title)
      .set("terms", Json::array_of(evaluation.terms))
      .set("measures", measures)
      .set("rows", rows)
      .set("notes", Json::array_of(evaluation.notes))
      .set("subjects", subjects);
}

void write_evaluation(const Evaluation& evaluation,
                      const std::vector<CheckResult::Picture>& pictures,
                      const std::filesystem::path& folder) {
  evaluation_json(evaluation).write(folder / "report.json");
  std::string html = page_head(evaluation.task + ": " + evaluation.title);
  html += fmt::format("<header><p class=\"kind\">terracast evaluation</p><h1>{}: {}</h1>",
                      escaped(evaluation.task), escaped(evaluation.title));
  for (const std::string& term : evaluation.terms)
    html += fmt::format("<p class=\"about\">{}</p>", escaped(term));
  html += "</header>\n" + table_html(evaluation);
  for (const std::string& note : evaluation.notes)
    html += fmt::format("<p class=\"about\">{}</p>\n", escaped(note));
  if (!pictures.empty()) {
    html += "<h2>The worst frame</h2>\n<div class=\"figures\">\n";
    for (const CheckResult::Picture& picture : pictures) html += figure(picture);
    html += "</div>\n";
  }
  for (const SubjectScore& subject : evaluation.subjects)
    html += fmt::format("<h2>{}, {}</h2>\n", escaped(subject.sequence), escaped(subject.camera)) +
            plots_html(evaluation, subject);
  core::write_file(folder / "index.html", html + page_end());
}

}  // namespace terracast::validate
