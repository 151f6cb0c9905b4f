#include <arpa/inet.h>
#include <cpl_conv.h>
#include <netinet/in.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <chrono>
#include <fstream>

#include "tests/tiler/vector_files.h"
#include "tiler/gdal_support.h"
#include "tiler/raster_source.h"
#include "tiler/vector_source.h"

/// Files that name what is elsewhere: none of it is asked for.
namespace terracast::test {
namespace {

namespace fs = std::filesystem;
using core::ErrorKind;

/// Listens on this machine, answers nothing, and knows who has come.
class Listener {
 public:
  Listener() : socket_(::socket(AF_INET, SOCK_STREAM, 0)) {
    sockaddr_in address = {};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    EXPECT_EQ(::bind(socket_, reinterpret_cast<sockaddr*>(&address), sizeof address), 0);
    EXPECT_EQ(::listen(socket_, 16), 0);
    socklen_t size = sizeof address;
    EXPECT_EQ(::getsockname(socket_, reinterpret_cast<sockaddr*>(&address), &size), 0);
    port_ = ntohs(address.sin_port);
    CPLSetConfigOption("GDAL_HTTP_TIMEOUT", "2");  // where something does ask, it is not answered
  }
  ~Listener() { ::close(socket_); }
  Listener(const Listener&) = delete;
  Listener& operator=(const Listener&) = delete;

  std::string address() const { return fmt::format("http://127.0.0.1:{}", port_); }
  int port() const { return port_; }
  /// Who came since it was last asked.
  int num_connections() const {
    int count = 0;
    for (pollfd waiting{socket_, POLLIN, 0}; ::poll(&waiting, 1, 0) > 0; ++count)
      ::close(::accept(socket_, nullptr, nullptr));
    return count;
  }

 private:
  int socket_;
  int port_ = 0;
};

TEST(NetworkNames, TheListenerSeesWhoComes) {
  const Listener listener;
  EXPECT_EQ(listener.num_connections(), 0);
  const int caller = ::socket(AF_INET, SOCK_STREAM, 0);
  sockaddr_in address = {};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  address.sin_port = htons(static_cast<std::uint16_t>(listener.port()));
  ASSERT_EQ(::connect(caller, reinterpret_cast<sockaddr*>(&address), sizeof address), 0);
  EXPECT_EQ(listener.num_connections(), 1);
  EXPECT_EQ(listener.num_connections(), 0);
  ::close(caller);
}

/// Opens a raster and reads all of it.
tiler::Grid<double> read_raster(const fs::path& file) {
  const auto raster =
      tiler::RasterSource::open(path_of(file), {}, {.lat_deg = 42.5, .lon_deg = 1.5});
  return raster->read({.first_column = 0,
                       .first_row = 0,
                       .width = raster->grid().width(),
                       .height = raster->grid().height()});
}

std::string vrt(const std::string& band, const std::string& rest = "",
                const std::string& kind = "") {
  return "<VRTDataset rasterXSize=\"20\" rasterYSize=\"20\"" + kind +
         "><SRS>EPSG:4326</SRS><GeoTransform>1.4, 0.01, 0, 42.6, 0, -0.01</GeoTransform>" + band +
         rest + "</VRTDataset>\n";
}
std::string band_of(const std::string& source, bool is_relative = false, bool is_known = false) {
  return fmt::format(
      "<VRTRasterBand dataType=\"Float32\" band=\"1\"><SimpleSource><SourceFilename "
      "relativeToVRT=\"{}\">{}</SourceFilename>{}<SourceBand>1</SourceBand></SimpleSource>"
      "</VRTRasterBand>",
      is_relative ? 1 : 0, source,
      is_known ? "<SourceProperties RasterXSize=\"20\" RasterYSize=\"20\" DataType=\"Float32\" "
                 "BlockXSize=\"20\" BlockYSize=\"1\"/>"
               : "");
}

/// Its file is refused, when it is opened or read, soon, and nobody is asked.
void expect_refusal_without_calls(const Listener& listener, const fs::path& file,
                                  const std::string& text, const std::vector<std::string>& words) {
  SCOPED_TRACE(text);
  write_text(file, text);
  const auto start = std::chrono::steady_clock::now();
  std::vector<std::string> all = words;
  all.push_back(file.filename().string());
  expect_error(ErrorKind::Input, all, [&] { read_raster(file); });
  EXPECT_LT(std::chrono::steady_clock::now() - start, std::chrono::seconds(20));
  EXPECT_EQ(listener.num_connections(), 0);
}

TEST(NetworkNames, RastersThatLeadToANetworkAskNobody) {
  const ScratchFolder folder;
  const Listener listener;
  const std::string address = listener.address() + "/a.tif";
  const auto refuses = [&](const std::string& text, const std::vector<std::string>& words,
                           const char* name = "outer.vrt") {
    expect_refusal_without_calls(listener, folder / name, text, words);
  };
  const std::vector<std::string> no_file = {"networks and streams are not read"};
  for (const bool is_known : {false, true}) {
    refuses(vrt(band_of("/vsicurl/" + address, false, is_known)), no_file);
    refuses(vrt(band_of("/vsicurl_streaming/" + address, false, is_known)), no_file);
    refuses(vrt(band_of("/vsigzip//vsicurl/" + address + ".gz", false, is_known)), no_file);
    refuses(vrt(band_of("/vsizip//vsicurl/" + address + ".zip/a.tif", false, is_known)), {});
    refuses(vrt(band_of("/vsisubfile/0,/vsicurl/" + address, false, is_known)), no_file);
    refuses(vrt(band_of("/vsicurl?max_retry=0&amp;url=" + address, false, is_known)), {});
    refuses(vrt(band_of(address, false, is_known)), {});
    refuses(vrt(band_of("NETCDF:&quot;" + listener.address() + "/a.nc&quot;:z", false, is_known)),
            {});
    refuses(vrt(band_of("WMTS:" + listener.address() + "/wmts", false, is_known)), {});
  }
  refuses(vrt("<VRTRasterBand dataType=\"Float32\" band=\"1\" subClass=\"VRTRawRasterBand\">"
              "<SourceFilename relativeToVRT=\"0\">/vsicurl/" +
              address + "</SourceFilename></VRTRasterBand>"),
          {});
  refuses(vrt("<VRTRasterBand dataType=\"Float32\" band=\"1\" subClass=\"VRTWarpedRasterBand\"/>",
              "<BlockXSize>20</BlockXSize><BlockYSize>20</BlockYSize><GDALWarpOptions>"
              "<SourceDataset relativeToVRT=\"0\">/vsicurl/" +
                  address + "</SourceDataset></GDALWarpOptions>",
              " subClass=\"VRTWarpedDataset\""),
          no_file);
  const std::string map_server =
      "<GDAL_WMS><Service name=\"TMS\"><ServerUrl>" + listener.address() +
      "/${z}/${x}/${y}.png</ServerUrl></Service><DataWindow><UpperLeftX>1.4</UpperLeftX>"
      "<UpperLeftY>42.6</UpperLeftY><LowerRightX>1.6</LowerRightX><LowerRightY>42.4</LowerRightY>"
      "<SizeX>20</SizeX><SizeY>20</SizeY></DataWindow><Projection>EPSG:4326</Projection>"
      "<BlockSizeX>20</BlockSizeX><BlockSizeY>20</BlockSizeY><BandsCount>1</BandsCount></GDAL_WMS>";
  refuses(map_server, {"leads to a network"}, "server.xml");
  refuses("<GDAL_WMTS><GetCapabilitiesUrl>" + address +
              "</GetCapabilitiesUrl><Layer>a</Layer></GDAL_WMTS>",
          {"leads to a network"}, "tiles.xml");
  // What a VRT leads to, and that to: by files of any kind.
  refuses(vrt(band_of("server.xml", true, false)), {});
  refuses(vrt(band_of("server.xml", true, true)), {});
  write_text(folder / "inner.vrt", vrt(band_of("/vsicurl/" + address, false, true)));
  refuses(vrt(band_of("inner.vrt", true, true)), no_file);
}

/// Overviews elsewhere, which a GeoTIFF or the file beside it may name: they are not needed.
TEST(NetworkNames, OverviewsElsewhereAreNotLookedFor) {
  const ScratchFolder folder;
  const Listener listener;
  RasterSpec spec = utm_spec(1024.0, 32.0);
  spec.value = [](double, double) { return 100.0; };
  write_raster(folder / "heights.tif", spec);
  write_text(folder / "heights.tif.aux.xml",
             "<PAMDataset><Metadata domain=\"OVERVIEWS\"><MDI key=\"OVERVIEW_FILE\">/vsicurl/" +
                 listener.address() + "/a.ovr</MDI></Metadata></PAMDataset>");
  EXPECT_EQ(read_raster(folder / "heights.tif").values.front(), 100.0);
  const tiler::GdalErrors errors;
  const auto dataset = tiler::open_gdal_raster(path_of(folder / "heights.tif"), errors);
  EXPECT_EQ(dataset->GetRasterBand(1)->GetOverviewCount(), 0);
  EXPECT_EQ(listener.num_connections(), 0);
}

/// gdalbuildvrt writes such names.
TEST(NetworkNames, VrtsNameFilesOfOtherFoldersAndAreAsThoseAre) {
  const ScratchFolder folder;
  fs::create_directories(folder / "tiles");
  fs::create_directories(folder / "mosaics");
  RasterSpec spec;
  spec.width = spec.height = 20;
  spec.crs = "EPSG:4326";
  spec.geotransform = {1.4, 0.01, 0.0, 42.6, 0.0, -0.01};
  spec.value = [](double u, double v) { return 1000.0 * u + v; };
  write_raster(folder / "tiles" / "a.tif", spec);
  write_text(folder / "mosaics" / "inner.vrt", vrt(band_of("../tiles/a.tif", true)));
  write_text(folder / "outer.vrt", vrt(band_of("mosaics/inner.vrt", true, true)));
  const auto heights = read_raster(folder / "outer.vrt");
  // In floats; the first pixel's centre lies half a pixel in.
  EXPECT_NEAR(heights(0, 0), 1000.0 * 1.405 + 42.595, 1e-3);
  EXPECT_NEAR(heights(19, 19), 1000.0 * 1.595 + 42.405, 1e-3);

  // What such a file is made of counts, and not what other programs note beside it.
  const auto hash = [&] {
    return tiler::RasterSource::open(path_of(folder / "outer.vrt"), {},
                                     {.lat_deg = 42.5, .lon_deg = 1.5})
        ->content_hash();
  };
  const std::string before = hash();
  EXPECT_EQ(hash(), before);
  write_text(folder / "tiles" / "a.tif.aux.xml", "<PAMDataset></PAMDataset>\n");
  EXPECT_EQ(hash(), before);
  spec.value = [](double u, double v) { return 1000.0 * u + v + (u > 1.59 && v < 42.41 ? 1 : 0); };
  write_raster(folder / "tiles" / "a.tif", spec);
  EXPECT_NE(hash(), before);
}

TEST(NetworkNames, FeaturesThatLeadToANetworkAskNobody) {
  const ScratchFolder folder;
  const Listener listener;
  const auto read = [&](const fs::path& file) {
    const geo::WorldFrame frame(
        {.lat_deg = kOriginLat_deg, .lon_deg = kOriginLon_deg, .height_m = 0.0});
    return tiler::read_vectors(path_of(file), {},
                               {.frame = frame,
                                .size_m = 20480.0,
                                .ground_height_m = [](const geo::Geodetic&) { return 0.0; }});
  };
  write_text(folder / "points.geojson",
             R"({"type":"FeatureCollection","crs":{"type":"link","properties":{"href":")" +
                 listener.address() +
                 R"(/crs","type":"ogcwkt"}},"features":[{"type":"Feature","properties":{},)"
                 R"("geometry":{"type":"Point","coordinates":[1.5,42.5]}}]})");
  write_text(folder / "points.gml",
             "<?xml version=\"1.0\"?><ogr:FeatureCollection xmlns:ogr=\"http://ogr.maptools.org/\" "
             "xmlns:gml=\"http://www.opengis.net/gml\" "
             "xmlns:xsi=\"http://www.w3.org/2001/XMLSchema-instance\" xsi:schemaLocation=\"" +
                 listener.address() + "/a " + listener.address() +
                 "/a.xsd\"><gml:featureMember><ogr:a><ogr:geometry><gml:Point srsName=\"" +
                 listener.address() +
                 "/crs\"><gml:coordinates>1.5,42.5</gml:coordinates></gml:Point></ogr:geometry>"
                 "</ogr:a></gml:featureMember></ogr:FeatureCollection>");
  for (const char* name : {"points.geojson", "points.gml"}) {
    SCOPED_TRACE(name);
    // Whether the reference system that is not there is missed, or its default taken, is the format's matter.
    try {
      read(folder / name);
    } catch (const core::Error& error) {
      EXPECT_EQ(error.kind(), ErrorKind::Input) << error.what();
    }
    EXPECT_EQ(listener.num_connections(), 0);
  }
}

}  // namespace
}  // namespace terracast::test
