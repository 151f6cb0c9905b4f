#pragma once

#include <cstddef>
#include <span>

#include "core/ledger.h"
#include "tiler/objects/model_folder.h"
#include "tiler/objects/model_scene.h"

namespace terracast::tiler {

/// Reads an OBJ and the libraries of materials (.mtl) that it names: faces of any number of corners, indices from the
/// beginning or back from where they stand, colours behind the places of vertices (v x y z r g b), Kd and map_Kd with its
/// options. Kd and colours of vertices are what a screen shows (sRGB), as Blender, MeshLab and three.js have them; they
/// multiply each other, and Kd multiplies map_Kd, as the format's own text says. Where a surface has a picture, colours of
/// its vertices are not seen: programs that reconstruct surfaces write both, for one colour.
/// throws   Input: more than the bounds of obj_check.h, numbers that are none, corners that there are none of
ModelScene read_obj(std::span<const std::byte> bytes, ModelFolder& folder);

/// Statements that it knows.
std::span<const core::KnownName> obj_names();

}  // namespace terracast::tiler
