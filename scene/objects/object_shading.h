#pragma once

#include "scene/light/sky.h"
#include "scene/objects/object_look.h"

namespace terracast::scene {

/// How an object's place is lit and from where it is seen.
struct ObjectLight {
  Eigen::Vector3f to_camera;  ///< unit
  float sun_share;            ///< of the sun's disc, seen from the place, 0 … 1
  /// Of the light of the surroundings what comes past objects near by; below 0: nobody has looked.
  float sky_share;
};

/// Share of light that a layer mirrors at an angle of which `cosine` is the cosine (Schlick 1994).
float mirrored_share(float facing, float cosine);

/// Radiance that leaves an object's place towards the camera.
/// threads   safe
Color object_radiance(const ObjectLook& look, const ObjectLight& light, const Sky& sky);

}  // namespace terracast::scene
