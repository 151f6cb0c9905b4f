#pragma once

#include <openvdb/openvdb.h>

#include <cstddef>
#include <vector>

/// What the writers of this folder share. Nobody else includes it: it brings OpenVDB along.
namespace terracast::world {

/// Calls openvdb::initialize() once.
void initialise_vdb();

/// A file of grids, whose random identity is replaced by one that follows from its content.
std::vector<std::byte> bytes_of_grids(const openvdb::GridCPtrVec& grids);

}  // namespace terracast::world
