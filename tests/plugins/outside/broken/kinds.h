#pragma once

#include "export/exporter.h"
#include "geo/camera_model.h"
#include "scene/media/medium.h"
#include "sensors/sensor.h"
#include "tiler/layer.h"
#include "validate/checks/checker.h"

namespace broken {

terracast::sensors::SensorInfo throwing_sensor();
terracast::sensors::SensorInfo hanging_sensor();
terracast::sensors::SensorInfo nan_sensor();
terracast::sensors::SensorInfo counting_sensor();
terracast::sensors::SensorInfo crashing_sensor();
terracast::sensors::SensorInfo leaving_sensor();
terracast::sensors::SensorInfo exiting_sensor();
terracast::sensors::SensorInfo nameless_sensor();
terracast::sensors::SensorInfo shadowing_sensor();
terracast::sensors::SensorInfo uncopied_sensor();
terracast::geo::CameraModelInfo shifted_camera();
terracast::tiler::LayerKindInfo counting_layer();
terracast::exporters::ExporterInfo dated_exporter();
terracast::scene::MediumInfo brightening_medium();
terracast::scene::MediumInfo absent_medium();
terracast::validate::CheckInfo strict_check();

}  // namespace broken
