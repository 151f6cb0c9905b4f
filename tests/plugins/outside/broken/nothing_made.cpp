// A kind whose maker returns nothing.
#include "plugins/plugin.h"
#include "sensors/sensor.h"

namespace {

terracast::sensors::SensorInfo laser_sensor() {
  return {.name = "nothing.laser",
          .summary = "is never made",
          .make = []() -> std::unique_ptr<terracast::sensors::Sensor> { return nullptr; }};
}

}  // namespace

TERRACAST_PLUGIN("nothing", "1", "MIT", laser_sensor())
