// Its initialiser does what the environment variable TERRACAST_AT_LOAD says.
#include <unistd.h>
#include <xmmintrin.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <iostream>
#include <stdexcept>
#include <string_view>
#include <thread>

#include "plugins/plugin.h"
#include "sensors/sensor.h"

namespace {

using namespace terracast;

/// Flags of the processor by which tiny numbers are 0, as initialisers of -ffast-math set them.
constexpr unsigned kFlushToZero = 0x8040;

struct Initialiser {
  Initialiser() {
    const char* what = std::getenv("TERRACAST_AT_LOAD");
    const std::string_view does = what == nullptr ? "" : what;
    if (does == "throw") throw std::runtime_error("no licence server");
    if (does == "crash") std::abort();
    if (does == "exit") std::exit(0);
    if (does == "leave") _exit(0);
    if (does == "hang") {
      std::cerr << "hanging" << std::endl;
      while (true) std::this_thread::sleep_for(std::chrono::seconds(1));
    }
    if (does == "flush") _mm_setcsr(_mm_getcsr() | kFlushToZero);
  }
} initialiser;

/// Measures whether tiny numbers are 0.
struct FlushSensor : sensors::Sensor {
  void describe(core::SchemaVisitor&) override {}
  std::unique_ptr<sensors::Sensor> clone() const override {
    return std::make_unique<FlushSensor>(*this);
  }
  std::vector<capture::StreamChannel> channels() const override {
    if ((_mm_getcsr() & kFlushToZero) != 0)
      core::fail(core::ErrorKind::Internal, "tiny numbers are 0");
    return {{.name = "value", .unit = ""}};
  }
  void measure(const sensors::SensorSite&, std::span<const double>,
               std::span<double> values) const override {
    std::fill(values.begin(), values.end(), 1.0);
  }
};

sensors::SensorInfo flush_sensor() {
  return {.name = "at_load.flush", .summary = "the processor's state", .make = [] {
            return std::unique_ptr<sensors::Sensor>(std::make_unique<FlushSensor>());
          }};
}

}  // namespace

TERRACAST_PLUGIN("at_load", "1", "MIT", flush_sensor())
