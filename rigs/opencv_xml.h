#pragma once

#include <string>
#include <string_view>

namespace YAML {
class Node;
}

namespace terracast::rigs {

/// Whether a text is what OpenCV's FileStorage writes as XML.
bool is_opencv_xml(std::string_view text);

/// The same values as OpenCV's FileStorage writes as YAML: elements are keys, those called _ items of a list, several
/// numbers, and those of <data>, a list.
/// file     for messages
/// throws   Input: no XML, no opencv_storage, elements in each other more than 20 deep
YAML::Node node_of_opencv_xml(const std::string& text, const std::string& file);

}  // namespace terracast::rigs
