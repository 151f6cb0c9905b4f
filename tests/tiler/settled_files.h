#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace terracast::test {

/// Small files of all kinds that layers read, of one place round the tests' origin: a village at a street, a river
/// under a bridge, a lake, woods. What stands at the origin reaches over the borders of the tiles of all levels.
///
/// Writes them into a folder and says, as keys of a layer, in which ways layers are made of them; a kind of layers
/// takes the first whose keys it has.
std::vector<std::string> write_settled_files(const std::filesystem::path& folder);

}  // namespace terracast::test
