#pragma once

#include <filesystem>
#include <string>

namespace terracast::test {

/// A job over a kilometre on which every layer stands: a coast with a sea floor, a river and a bridge over it, streets
/// with cars, houses and blocks with courtyards, a wood, a line with towers, a pier and a marina. One sequence
/// over the town (`P000`), one in the sea (`P001`); COLMAP, KITTI and TartanAir V1 by rigs of their own.
/// Writes its sources and the config into a folder.
/// returns   the config
std::filesystem::path write_settled_job(const std::filesystem::path& folder);

}  // namespace terracast::test
