#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "depthservo/api.h"

namespace depthservo::detail {

/// Where a module of this file name may be: beside the library that holds this function, or where
/// it is installed.
DEPTHSERVO_INNER std::vector<std::filesystem::path> modulePlaces(const std::string& file);

/// Loads a module from the first of these places where it is, and gives its function of this name.
/// Modules bring the many libraries that most runs do not need.
/// \param lack what there is not without it \throw InputError it is not there, or cannot be loaded
DEPTHSERVO_INNER void* loadModule(const std::vector<std::filesystem::path>& places,
                                  const char* function, const std::string& lack);

}  // namespace depthservo::detail
