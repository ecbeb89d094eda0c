# Every package the libraries and the tool need. Tests find their own in test/CMakeLists.txt.

find_package(Eigen3 3.4 REQUIRED NO_MODULE)

include(DepthservoFindVisp)
depthservo_find_visp(REQUIRED COMPONENTS visp_core visp_blob visp_gui visp_io visp_robot visp_vision
                                         visp_visual_features visp_vs)

find_package(OpenCV 4.5.1 REQUIRED COMPONENTS core imgproc imgcodecs calib3d video videoio aruco)
find_package(PNG 1.6.32 REQUIRED)
find_package(JPEG REQUIRED)
find_package(ZLIB REQUIRED)
find_package(BZip2 REQUIRED)
find_package(yaml-cpp 0.7 REQUIRED)
find_package(nlohmann_json 3.11 REQUIRED)
find_package(fmt 9 REQUIRED)
find_package(apriltag 3.2 REQUIRED)
find_package(TBB REQUIRED)

find_package(PkgConfig REQUIRED)
pkg_check_modules(CAIRO REQUIRED IMPORTED_TARGET cairo-pdf)
pkg_check_modules(BAGS REQUIRED IMPORTED_TARGET liblz4 libzstd sqlite3>=3.35)
