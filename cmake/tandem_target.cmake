# How every target of the project is compiled: one place for the flags.

add_library(tandem_flags INTERFACE)
target_compile_options(tandem_flags INTERFACE
  -Wall -Wextra -Wpedantic -Wshadow -Wnon-virtual-dtor -Woverloaded-virtual -Wcast-qual)
if(TANDEM_WERROR)
  target_compile_options(tandem_flags INTERFACE -Werror)
endif()
# GCC 12 reports false positives of these inside inlined library code (Eigen, Asio, std::string concatenation).
if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
  target_compile_options(tandem_flags INTERFACE
    -Wno-array-bounds -Wno-stringop-overflow -Wno-stringop-overread -Wno-maybe-uninitialized -Wno-restrict)
endif()
# GCC's garbage collection takes 4 to 6 % of the compile time of a file with many templates (-ftime-report). Below
# this heap size [kB] it does not run; such a file then takes a fifth more memory.
if(CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
  target_compile_options(tandem_flags INTERFACE --param=ggc-min-heapsize=1500000)
endif()
# A sum has one fixed order and no contraction into FMA, so results do not change with the CPU.
target_compile_options(tandem_flags INTERFACE -ffp-contract=off -fno-math-errno)
target_include_directories(tandem_flags INTERFACE ${PROJECT_SOURCE_DIR})
# What names a file in a message names it from here; a program does not say where it was built.
target_compile_options(tandem_flags INTERFACE -ffile-prefix-map=${PROJECT_SOURCE_DIR}/=)

if(TANDEM_SANITIZE)
  # Every target gets the same switches, generated code too. Assertions are on; line tables are enough to read a report.
  add_compile_options(-fsanitize=${TANDEM_SANITIZE} -fno-omit-frame-pointer -fno-sanitize-recover=all -O1 -g1 -UNDEBUG)
  add_link_options(-fsanitize=${TANDEM_SANITIZE})
  # lld links these programs of up to 80 MB in a third of the processor time.
  find_program(TANDEM_LLD ld.lld)
  if(TANDEM_LLD)
    add_link_options(-fuse-ld=lld)
  endif()
  if(TANDEM_SANITIZE STREQUAL "address,undefined")
    # AddressSanitizer sees what these look for at every access, and they are a third of the compile time. By night they
    # are on (preset ubsan).
    add_compile_options(-fno-sanitize=null,alignment,vptr,object-size,pointer-overflow,nonnull-attribute,returns-nonnull-attribute)
  endif()
  if(TANDEM_SANITIZE MATCHES "address")
    # What nobody has set is NaN, and so is what is made of it: `Wrench{force, {}}` leaves its torque as it was in memory.
    add_compile_definitions(EIGEN_INITIALIZE_MATRICES_BY_NAN)
  endif()
  if(TANDEM_SANITIZE MATCHES "thread")
    # ThreadSanitizer does not model fences; Asio's own are not needed where every hand-over has a lock.
    add_compile_definitions(BOOST_ASIO_DISABLE_FENCED_BLOCK)
  endif()
endif()

# A compiler cache, where there is one. Precompiled headers need it to trust what the compiler says of them.
option(TANDEM_CCACHE "Compile through ccache where it is installed" ON)
find_program(CCACHE_PROGRAM ccache)
if(TANDEM_CCACHE AND CCACHE_PROGRAM)
  set(CMAKE_CXX_COMPILER_LAUNCHER
    ${CMAKE_COMMAND} -E env CCACHE_BASEDIR=${PROJECT_SOURCE_DIR} CCACHE_NOHASHDIR=1 CCACHE_SLOPPINESS=pch_defines,time_macros,include_file_mtime,include_file_ctime
    ${CCACHE_PROGRAM})
endif()

# Headers of other projects that nearly every file includes, compiled once for the product and once for the tests.
# Every file still includes what it uses: -DTANDEM_PCH=OFF builds without.
option(TANDEM_PCH "Precompile the headers of other projects that nearly every file includes" ON)
set(tandem_common_headers
  <algorithm> <array> <chrono> <cmath> <cstdint> <filesystem> <functional> <limits> <map> <memory> <optional> <set> <span>
  <sstream> <stdexcept> <string> <string_view> <utility> <vector> <Eigen/Dense> <boost/container/static_vector.hpp>)

# What a file includes takes longer to compile than the file: several are compiled as one. So no name of an unnamed
# namespace is in two files of a library or program. -DTANDEM_UNITY=OFF compiles each alone.
option(TANDEM_UNITY "Compile several files of a library or program as one" ON)
set(CMAKE_UNITY_BUILD ${TANDEM_UNITY})
set(CMAKE_UNITY_BUILD_BATCH_SIZE 10)
if(TANDEM_UNITY AND CMAKE_CXX_COMPILER_ID STREQUAL "GNU")
  target_compile_options(tandem_flags INTERFACE -Wno-subobject-linkage)  # it takes the files for headers
endif()

# tandem_precompiled(name OPTIONS compile options HEADERS ...): a library that only others' REUSE_FROM refers to.
function(tandem_precompiled name)
  cmake_parse_arguments(ARG "" "" "OPTIONS;LINK;HEADERS" ${ARGN})
  file(WRITE ${CMAKE_CURRENT_BINARY_DIR}/${name}.cpp "// Nothing: the precompiled header is all of this target.\n")
  add_library(${name} OBJECT ${CMAKE_CURRENT_BINARY_DIR}/${name}.cpp)
  target_link_libraries(${name} PRIVATE tandem_flags ${ARG_LINK})
  target_compile_options(${name} PRIVATE ${ARG_OPTIONS})
  target_precompile_headers(${name} PRIVATE ${ARG_HEADERS})
  # What stands for the precompiled header in the compiler cache (pch_external_checksum): the file itself contains the
  # path of the build folder, so that two checkouts would never share an object.
  string(SHA256 sum "${ARG_HEADERS};${ARG_OPTIONS};${CMAKE_CXX_COMPILER_VERSION};${CMAKE_BUILD_TYPE};${TANDEM_SANITIZE};\
${Eigen3_VERSION};${Boost_VERSION};${GTest_VERSION}")
  file(WRITE ${CMAKE_CURRENT_BINARY_DIR}/CMakeFiles/${name}.dir/cmake_pch.hxx.gch.sum "${sum}\n")
endfunction()

function(tandem_use_precompiled name precompiled)
  if(TANDEM_PCH)
    target_precompile_headers(${name} REUSE_FROM ${precompiled})
  endif()
endfunction()

# tandem_library(name SOURCES ... LINK public libraries... PRIVATE_LINK libraries kept out of our headers)
function(tandem_library name)
  cmake_parse_arguments(ARG "" "" "SOURCES;LINK;PRIVATE_LINK" ${ARGN})
  add_library(${name} STATIC ${ARG_SOURCES})
  target_link_libraries(${name} PUBLIC tandem_flags ${ARG_LINK} PRIVATE ${ARG_PRIVATE_LINK})
  tandem_use_precompiled(${name} tandem_precompiled_product)
endfunction()

# tandem_program(name SOURCES ... LINK ...)
function(tandem_program name)
  cmake_parse_arguments(ARG "" "" "SOURCES;LINK" ${ARGN})
  add_executable(${name} ${ARG_SOURCES})
  target_link_libraries(${name} PRIVATE tandem_flags ${ARG_LINK})
  tandem_use_precompiled(${name} tandem_precompiled_product)
endfunction()
