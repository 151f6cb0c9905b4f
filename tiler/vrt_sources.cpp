#include "tiler/vrt_sources.h"

#include <cpl_conv.h>
#include <cpl_minixml.h>
#include <cpl_vsi.h>

#include <string_view>

#include "core/error.h"
#include "tiler/gdal_support.h"

namespace terracast::tiler {
namespace {

void find_named(const CPLXMLNode* node, const std::string& folder,
                std::vector<std::string>& names) {
  for (; node != nullptr; node = node->psNext) {
    const std::string_view element = node->eType == CXT_Element ? node->pszValue : "";
    if (element == "SourceFilename" || element == "SourceDataset") {
      const char* name = CPLGetXMLValue(node, nullptr, "");
      const bool is_relative = CPLTestBool(
          CPLGetXMLValue(node, "relativeToVRT", CPLGetXMLValue(node, "relativetoVRT", "0")));
      names.emplace_back(is_relative ? CPLProjectRelativeFilename(folder.c_str(), name) : name);
    }
    find_named(node->psChild, folder, names);
  }
}

}  // namespace

std::vector<std::string> files_named_by_vrt(const std::string& vrt) {
  VSIStatBufL status;
  if (VSIStatL(vrt.c_str(), &status) == 0 && status.st_size > kMostVrtBytes)
    core::fail(core::ErrorKind::Input,
               "{}: a VRT of {} bytes, and one of up to {} is read; split it, or have gdalbuildvrt "
               "write one of the files near the world alone (-te)",
               vrt, status.st_size, kMostVrtBytes);
  const GdalErrors quiet;
  const CPLXMLTreeCloser document(CPLParseXMLFile(vrt.c_str()));
  std::vector<std::string> names;
  find_named(document.get(), CPLGetPath(vrt.c_str()), names);
  return names;
}

}  // namespace terracast::tiler
