#include "core/progress.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <exception>
#include <mutex>
#include <optional>

#include "core/error.h"
#include "core/event_log.h"
#include "core/rate_window.h"
#include "core/stage_cost.h"

namespace terracast::core {

namespace {

constexpr double kTerminalPeriod_s = 1.0;
constexpr double kLogPeriod_s = 30.0;
constexpr double kSamplePeriod_s = 0.25;

double monotonic_s() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

/// Two or three digits that mean something: "123/s", "4.5/s", "20/min".
std::string rate_text(double rate_per_s) {
  if (rate_per_s >= 100.0) return fmt::format("{:.0f}/s", rate_per_s);
  if (rate_per_s >= 1.0) return fmt::format("{:.1f}/s", rate_per_s);
  return fmt::format("{:.2g}/min", rate_per_s * 60.0);
}

}  // namespace

void RateWindow::add(double time_s, std::int64_t done) {
  constexpr double kWindow_s = 30.0;
  constexpr std::int64_t kWindowUnits = 8;
  samples_.push_back({time_s, done});
  while (samples_.size() > 2 && samples_[1].time_s <= time_s - kWindow_s &&
         samples_[1].done <= done - kWindowUnits)
    samples_.pop_front();
}

std::optional<double> RateWindow::rate() const {
  const Sample& first = samples_.front();
  const Sample& last = samples_.back();
  if (last.done <= first.done || last.time_s <= first.time_s) return std::nullopt;
  return static_cast<double>(last.done - first.done) / (last.time_s - first.time_s);
}

std::optional<double> RateWindow::time_for(std::int64_t count) const {
  const std::optional<double> per_s = rate();
  if (!per_s) return std::nullopt;
  return static_cast<double>(count) / *per_s;
}

struct Progress::Impl {
  const Log& log;
  std::string what;
  std::int64_t total;
  bool on_terminal;
  EventLog events;

  std::mutex mutex;
  double start_s = monotonic_s();
  double last_sample_s = start_s;
  double last_report_s = start_s;
  std::int64_t worked = 0;
  std::int64_t skipped = 0;
  RateWindow window{start_s};

  Impl(const Context& context, std::string unit, std::int64_t count)
      : log(context.log),
        what(std::move(unit)),
        total(count),
        on_terminal(::isatty(STDERR_FILENO) == 1 && context.log.level() <= LogLevel::Info),
        events(context) {
    TERRACAST_CHECK(count >= 0, "{} {}", count, what);
  }

  std::int64_t done() const { return worked + skipped; }
  std::int64_t left() const { return std::max<std::int64_t>(total - done(), 0); }

  void add(std::int64_t more_worked, std::int64_t more_skipped) {
    const std::lock_guard lock(mutex);
    worked += more_worked;
    skipped += more_skipped;
    const double now_s = monotonic_s();
    if (now_s - last_sample_s >= kSamplePeriod_s) {
      window.add(now_s, worked);
      last_sample_s = now_s;
    }
    if (now_s - last_report_s < (on_terminal ? kTerminalPeriod_s : kLogPeriod_s)) return;
    last_report_s = now_s;
    report();
  }

  void report() {
    const std::optional<double> rate = window.rate();
    const std::optional<double> left_s = window.time_for(left());
    std::string line = fmt::format("{} of {} {}", done(), total, what);
    if (rate) line += ", " + rate_text(*rate);
    if (left_s) line += ", " + duration_text(*left_s) + " left";
    if (on_terminal) {
      fmt::print(stderr, "\r\033[K{}", line);
      std::fflush(stderr);
    } else {
      log.info("{}", line);
    }
    write_event(rate, left_s);
  }

  void report_end() {
    const double elapsed_s = monotonic_s() - start_s;
    std::optional<double> rate;
    if (worked > 0 && elapsed_s > 0.0) rate = static_cast<double>(worked) / elapsed_s;
    std::string line =
        fmt::format("{} of {} {} in {}", done(), total, what, duration_text(elapsed_s));
    if (rate) line += ", " + rate_text(*rate);
    if (skipped > 0) line += fmt::format(" ({} were there already)", skipped);
    log.info("{}", line);
    std::optional<double> left_s;
    if (rate) left_s = static_cast<double>(left()) / *rate;
    if (left() == 0) left_s = 0.0;
    write_event(rate, left_s);
  }

  void write_event(std::optional<double> rate, std::optional<double> left_s) {
    events.write(Json::object()
                     .set("what", what)
                     .set("done", done())
                     .set("total", total)
                     .set("rate", rate ? Json(*rate) : Json())
                     .set("left_s", left_s ? Json(*left_s) : Json()));
  }
};

Progress::Progress(const Context& context, std::string what, std::int64_t total)
    : impl_(std::make_unique<Impl>(context, std::move(what), total)) {}

Progress::~Progress() {
  try {
    impl_->report_end();
  } catch (const std::exception&) {
    // A report that cannot be made must not end the work that it reports.
  }
}

void Progress::advance(std::int64_t count) { impl_->add(count, 0); }

void Progress::skip(std::int64_t count) { impl_->add(0, count); }

}  // namespace terracast::core
