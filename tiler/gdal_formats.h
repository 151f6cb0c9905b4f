#pragma once

namespace terracast::tiler {

/// Names of GDAL's drivers that open what users name, of rasters and of features; each list ends with null. All of them read
/// files and nothing else. netCDF is none: its own library fetches what it takes for an address.
extern const char* const kRasterFormats[];
extern const char* const kVectorFormats[];

/// Those of them that this process reads itself: formats that many programs read every day, whose readers others try with
/// millions of wrong files. All others are read in a process of its own (tiler/apart).
extern const char* const kTroddenRasters[];
extern const char* const kTroddenVectors[];

/// Makes GDAL ready, for the whole process, without what reaches beyond files: it has the trodden drivers only, so that
/// those behind a name in a VRT, or in what lies beside a raster, are no others either; names such as /vsicurl/ and
/// /vsigzip/ cannot be opened; and nothing is fetched, as for the link to a GeoJSON's reference system.
/// threads   safe
void register_gdal();

/// As register_gdal(), with all drivers of the lists: for a process that reads apart, and for one that tries the readers
/// themselves. Before register_gdal().
void register_all_gdal();

/// Whether register_all_gdal() was first: this process reads all formats itself.
bool has_all_gdal();

}  // namespace terracast::tiler
