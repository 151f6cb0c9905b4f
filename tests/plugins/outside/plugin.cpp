// The kinds of docs/adding, as they stand on the pages, as one plug-in.
#include "plugins/plugin.h"

#include "export/exporter.h"
#include "geo/camera_model.h"
#include "scene/media/medium.h"
#include "sensors/sensor.h"
#include "tiler/layer.h"
#include "validate/checks/checker.h"

namespace terracast {

namespace exporters {
ExporterInfo places_exporter();
}
namespace geo {
CameraModelInfo stereographic_camera();
}
namespace scene {
MediumInfo smoke_layer_medium();
}
namespace sensors {
SensorInfo altimeter_sensor();
}
namespace tiler {
LayerKindInfo dunes_layer();
}
namespace validate {
CheckInfo turn_rate_check();
}

}  // namespace terracast

namespace {

/// The pages show what stands in the tree; kinds of a plug-in have its name before their own.
template <class Info>
Info named(const char* name, Info info) {
  info.name = name;
  return info;
}

}  // namespace

TERRACAST_PLUGIN("sample", "1.2", "MIT",
                 named("sample.altimeter", terracast::sensors::altimeter_sensor()),
                 named("sample.stereographic", terracast::geo::stereographic_camera()),
                 named("sample.dunes", terracast::tiler::dunes_layer()),
                 terracast::exporters::places_exporter(),
                 named("sample.smoke_layer", terracast::scene::smoke_layer_medium()),
                 named("sample.turn_rate", terracast::validate::turn_rate_check()))
