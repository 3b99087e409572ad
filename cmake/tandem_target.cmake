# Compiler flags and helper functions for all targets of the project.

add_library(tandem_flags INTERFACE)
target_compile_options(tandem_flags INTERFACE
  -Wall -Wextra -Wpedantic -Wshadow -Wnon-virtual-dtor -Woverloaded-virtual -Wcast-qual)
if(TANDEM_WERROR)
  target_compile_options(tandem_flags INTERFACE -Werror)
endif()
# GCC 12 gives false warnings of these kinds in inlined library code (Eigen, Asio, std::string concatenation).
if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
  target_compile_options(tandem_flags INTERFACE
    -Wno-array-bounds -Wno-stringop-overflow -Wno-stringop-overread -Wno-maybe-uninitialized -Wno-restrict)
endif()
# GCC's garbage collection takes 4 to 6 % of the compile time of a file with many templates (-ftime-report). It does not
# run below this heap size [kB]. Such a file then takes a fifth more memory.
if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
  target_compile_options(tandem_flags INTERFACE --param=ggc-min-heapsize=1500000)
endif()
# Sums are evaluated in a fixed order and not contracted into FMA, so that results do not depend on the CPU.
target_compile_options(tandem_flags INTERFACE -ffp-contract=off -fno-math-errno)
target_include_directories(tandem_flags INTERFACE ${PROJECT_SOURCE_DIR})
# Messages that contain the name of a source file name it relative to this folder, not the folder of the build.
target_compile_options(tandem_flags INTERFACE -ffile-prefix-map=${PROJECT_SOURCE_DIR}/=)

if(TANDEM_SANITIZE)
  # Every target gets the same switches, including generated code. Assertions are enabled. Line tables suffice to read a
  # report.
  add_compile_options(-fsanitize=${TANDEM_SANITIZE} -fno-omit-frame-pointer -fno-sanitize-recover=all -O1 -g1 -UNDEBUG)
  add_link_options(-fsanitize=${TANDEM_SANITIZE})
  # lld links these programs of up to 80 MB in a third of the processor time.
  find_program(TANDEM_LLD ld.lld)
  if(TANDEM_LLD)
    add_link_options(-fuse-ld=lld)
  endif()
  if(TANDEM_SANITIZE STREQUAL "address,undefined")
    # AddressSanitizer detects the same errors at every access, and these checks take a third of the compile time. The
    # nightly preset ubsan enables them.
    add_compile_options(-fno-sanitize=null,alignment,vptr,object-size,pointer-overflow,nonnull-attribute,returns-nonnull-attribute)
  endif()
  if(TANDEM_SANITIZE MATCHES "address")
    # Uninitialised values are NaN, as are all results computed from them: `Wrench{force, {}}` leaves its torque
    # uninitialised.
    add_compile_definitions(EIGEN_INITIALIZE_MATRICES_BY_NAN)
  endif()
  if(TANDEM_SANITIZE MATCHES "thread")
    # ThreadSanitizer does not model fences. Asio's fences are not needed if every exchange between threads uses a lock.
    add_compile_definitions(BOOST_ASIO_DISABLE_FENCED_BLOCK)
  endif()
endif()

# Uses a compiler cache if one is installed. With precompiled headers, ccache must rely on the compiler for some checks
# (CCACHE_SLOPPINESS).
option(TANDEM_CCACHE "Compile through ccache where it is installed" ON)
find_program(CCACHE_PROGRAM ccache)
if(TANDEM_CCACHE AND CCACHE_PROGRAM)
  set(CMAKE_CXX_COMPILER_LAUNCHER
    ${CMAKE_COMMAND} -E env CCACHE_BASEDIR=${PROJECT_SOURCE_DIR} CCACHE_NOHASHDIR=1 CCACHE_SLOPPINESS=pch_defines,time_macros,include_file_mtime,include_file_ctime
    ${CCACHE_PROGRAM})
endif()

# Headers of other projects that nearly every file includes. They are precompiled once for the product and once for the
# tests. Every file still includes all headers that it uses; -DTANDEM_PCH=OFF builds without precompiled headers.
option(TANDEM_PCH "Precompile the headers of other projects that nearly every file includes" ON)
set(tandem_common_headers
  <algorithm> <array> <chrono> <cmath> <cstdint> <filesystem> <functional> <limits> <map> <memory> <optional> <set> <span>
  <sstream> <stdexcept> <string> <string_view> <utility> <vector> <Eigen/Dense> <boost/container/static_vector.hpp>)

# Included headers take longer to compile than the file itself, so several files are compiled together. Therefore no
# name may be defined in the unnamed namespaces of two files of one library or program. -DTANDEM_UNITY=OFF compiles each
# file separately.
option(TANDEM_UNITY "Compile several files of a library or program as one" ON)
set(CMAKE_UNITY_BUILD ${TANDEM_UNITY})
set(CMAKE_UNITY_BUILD_BATCH_SIZE 10)
if(TANDEM_UNITY AND CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
  target_compile_options(tandem_flags INTERFACE -Wno-subobject-linkage)  # GCC takes the files for headers
endif()

# tandem_precompiled(NAME OPTIONS compile options HEADERS ...): a library whose precompiled header other targets use
# with REUSE_FROM.
function(tandem_precompiled name)
  cmake_parse_arguments(ARG "" "" "OPTIONS;LINK;HEADERS" ${ARGN})
  file(WRITE ${CMAKE_CURRENT_BINARY_DIR}/${name}.cpp "// Nothing: the precompiled header is all of this target.\n")
  add_library(${name} OBJECT ${CMAKE_CURRENT_BINARY_DIR}/${name}.cpp)
  target_link_libraries(${name} PRIVATE tandem_flags ${ARG_LINK})
  target_compile_options(${name} PRIVATE ${ARG_OPTIONS})
  target_precompile_headers(${name} PRIVATE ${ARG_HEADERS})
  # ccache uses this checksum instead of the precompiled header (pch_external_checksum). The header file contains the
  # path of the build folder, so two checkouts would never share an object.
  string(SHA256 sum "${ARG_HEADERS};${ARG_OPTIONS};${CMAKE_CXX_COMPILER_VERSION};${CMAKE_BUILD_TYPE};${TANDEM_SANITIZE};\
${Eigen3_VERSION};${Boost_VERSION};${GTest_VERSION}")
  file(WRITE ${CMAKE_CURRENT_BINARY_DIR}/CMakeFiles/${name}.dir/cmake_pch.hxx.gch.sum "${sum}\n")
endfunction()

function(tandem_use_precompiled name precompiled)
  if(TANDEM_PCH)
    target_precompile_headers(${name} REUSE_FROM ${precompiled})
  endif()
endfunction()

# The libraries are also linked into libtandem.so (client/embed), so they are position independent. Hidden symbols are
# called directly and data is addressed without an offset table, as in code that is not position independent.
set(tandem_product_options -fPIC -fvisibility=hidden -fvisibility-inlines-hidden -fno-semantic-interposition)

# tandem_library(NAME SOURCES ... LINK public libraries... PRIVATE_LINK libraries that our headers do not include)
function(tandem_library name)
  cmake_parse_arguments(ARG "" "" "SOURCES;LINK;PRIVATE_LINK" ${ARGN})
  add_library(${name} STATIC ${ARG_SOURCES})
  target_link_libraries(${name} PUBLIC tandem_flags ${ARG_LINK} PRIVATE ${ARG_PRIVATE_LINK})
  target_compile_options(${name} PRIVATE ${tandem_product_options})
  tandem_use_precompiled(${name} tandem_precompiled_product)
endfunction()

# tandem_program(name SOURCES ... LINK ...)
function(tandem_program name)
  cmake_parse_arguments(ARG "" "" "SOURCES;LINK" ${ARGN})
  add_executable(${name} ${ARG_SOURCES})
  target_link_libraries(${name} PRIVATE tandem_flags ${ARG_LINK})
  target_compile_options(${name} PRIVATE ${tandem_product_options})
  tandem_use_precompiled(${name} tandem_precompiled_product)
endfunction()
