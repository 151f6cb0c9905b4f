// A kind whose name is not below the plug-in's: it would stand where the program's own may come one day.
#include "plugins/plugin.h"
#include "sensors/sensor.h"

namespace {

terracast::sensors::SensorInfo laser_sensor() {
  return {.name = "rangefinder",
          .summary = "shadows the program's own",
          .make = []() -> std::unique_ptr<terracast::sensors::Sensor> { return nullptr; }};
}

}  // namespace

TERRACAST_PLUGIN("wrong", "1", "MIT", laser_sensor())
