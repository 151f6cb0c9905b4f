#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace terracast::core {

/// Makes what a process reads independent of who started it: takes the variables out of its environment by which
/// libraries (GDAL, PROJ, SQLite, OpenImageIO and others) change what files mean, or where grids and definitions are
/// found, keeps PROJ out of the user's own folder of grids and GDAL out of the user's own file of options, and sets
/// the locale "C". Processes that it starts inherit that.
///
/// PROJ_DATA, PROJ_LIB and GDAL_DATA are heeded where what they name is not in one of the usual places: there the
/// libraries might find nothing else.
/// threads   before any other is started: the first thing that main does
void settle_environment();

/// Names of the variables that settle_environment() took out, by the alphabet.
const std::vector<std::string>& unheeded_variables();

/// Whether a variable is one of those.
bool is_unheeded_variable(std::string_view name);

}  // namespace terracast::core
