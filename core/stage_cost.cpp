#include "core/stage_cost.h"

#include <fmt/format.h>
#include <sys/resource.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <exception>

#include "core/event_log.h"

namespace terracast::core {
namespace {

double wall_s() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

struct Usage {
  double cpu_s;
  double peak_bytes;
};
Usage usage() {
  rusage all{};
  ::getrusage(RUSAGE_SELF, &all);
  const auto seconds = [](const timeval& t) {
    return static_cast<double>(t.tv_sec) + 1e-6 * static_cast<double>(t.tv_usec);
  };
  return {.cpu_s = seconds(all.ru_utime) + seconds(all.ru_stime),
          .peak_bytes = 1024.0 * static_cast<double>(all.ru_maxrss)};
}

}  // namespace

std::string duration_text(double duration_s) {
  const auto seconds = static_cast<std::int64_t>(std::llround(std::min(duration_s, 1e12)));
  if (seconds >= 3600) return fmt::format("{} h {:02} min", seconds / 3600, seconds / 60 % 60);
  if (seconds >= 60) return fmt::format("{} min {:02} s", seconds / 60, seconds % 60);
  return fmt::format("{} s", seconds);
}

struct StageCost::Impl {
  const Log& log;
  std::string stage;
  EventLog events;
  double start_s = wall_s();
  Usage start = usage();

  void tell() {
    const double took_s = wall_s() - start_s;
    const Usage end = usage();
    const double cpu_s = end.cpu_s - start.cpu_s;
    log.info("{} took {}, {} of CPU; the process had up to {:.0f} MiB of memory so far", stage,
             duration_text(took_s), duration_text(cpu_s), end.peak_bytes / 1048576.0);
    events.write(Json::object()
                     .set("what", "stage")
                     .set("stage", stage)
                     .set("wall_s", took_s)
                     .set("cpu_s", cpu_s)
                     .set("peak_bytes", end.peak_bytes));
  }
};

StageCost::StageCost(const Context& context, std::string stage)
    : impl_(new Impl{.log = context.log, .stage = std::move(stage), .events = EventLog(context)}) {}

StageCost::~StageCost() {
  try {
    impl_->tell();
  } catch (const std::exception&) {
    // A report that cannot be made must not end the work that it reports.
  }
}

}  // namespace terracast::core
