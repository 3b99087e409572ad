# How tests are built, and which of them run when: `deploy/test` runs all but what is labelled `nightly`.
#
# label           run by, compiled with
# asan, tsan      .ci/run; AddressSanitizer and UndefinedBehaviorSanitizer, ThreadSanitizer
# nightly         deploy/nightly; optimised: what takes minutes
# asan-nightly, tsan-nightly, asan-lab, tsan-lab   deploy/nightly; as asan and tsan, of code that bytes from outside do not reach, and of
#                 the lab
#
# The target LABEL_tests builds what a sanitizer's label needs.
foreach(label asan tsan asan-nightly tsan-nightly asan-lab tsan-lab)
  add_custom_target(${label}_tests)
endforeach()

# The part of the night that runs NUMERIC tests of this folder under sanitizers: nightly, or lab.
set(tandem_night nightly)

# What tests check does not depend on how fast they are, and -O1 compiles in two thirds of the time.
set(tandem_test_options $<$<CONFIG:Release>:-O1>)
if(TANDEM_PCH)
  tandem_precompiled(tandem_precompiled_tests
    LINK Eigen3::Eigen Boost::headers GTest::gmock
    OPTIONS ${tandem_test_options}
    HEADERS ${tandem_common_headers} <gmock/gmock.h> <gtest/gtest.h>)
endif()
# What is built of meshes, and a server's keys, are kept between tests, apart from the user's own.
# Claims that the machine did not let them test are appended to left_out.txt.
set(tandem_test_environment
  "TANDEM_CACHE=${PROJECT_BINARY_DIR}/cache;TANDEM_STATE=${PROJECT_BINARY_DIR}/state;TANDEM_LEFT_OUT=${PROJECT_BINARY_DIR}/left_out.txt")
# A sanitizer makes numerical code up to a hundred times slower.
set(tandem_test_timeout 900)
if(TANDEM_SANITIZE)
  set(tandem_test_timeout 1800)
endif()

# tandem_run_test(name LABELS ... NEEDS targets COMMAND ...): one ctest entry.
function(tandem_run_test name)
  # By place, so that an argument of the command may be a list.
  cmake_parse_arguments(PARSE_ARGV 1 ARG "" "" "LABELS;NEEDS;COMMAND")
  add_test(NAME ${name} COMMAND ${ARG_COMMAND})
  set_tests_properties(${name} PROPERTIES
    LABELS "${ARG_LABELS}" TIMEOUT ${tandem_test_timeout} ENVIRONMENT "${tandem_test_environment}")
  foreach(label ${ARG_LABELS})
    if(TARGET ${label}_tests)
      add_dependencies(${label}_tests ${ARG_NEEDS})
    endif()
  endforeach()
endfunction()

# What of a GoogleTest program is run by one entry. A filter that no case matches any more fails.
function(tandem_run_cases name program filter labels)
  tandem_run_test(${name} LABELS ${labels} NEEDS ${program}
    COMMAND ${program} --gtest_brief=1 "--gtest_filter=${filter}")
  set_tests_properties(${name} PROPERTIES FAIL_REGULAR_EXPRESSION " 0 tests from 0 test suites ran")
endfunction()

# What is long begins first, so that no core waits for it in the end.
function(tandem_begin_early name is_slow)
  if(is_slow)
    set_tests_properties(${name} PROPERTIES COST 90)
  endif()
endfunction()

# tandem_test(name [SLOW|NUMERIC] [THREADS] [NIGHTLY Suite.Case ...] [NUMERIC_CASES Suite.Case ...] SOURCES ... LINK ...):
# one GoogleTest program and one ctest entry; a failure names its case. NIGHTLY (patterns as of --gtest_filter): left out
# of that entry, and run by name.nightly. THREADS: more than one thread takes part. NUMERIC: meets no bytes from outside;
# under sanitizers only in the night. NUMERIC_CASES: likewise, of some cases (name.numeric). SLOW: never.
function(tandem_test name)
  cmake_parse_arguments(ARG "SLOW;NUMERIC;THREADS" "" "NIGHTLY;NUMERIC_CASES;SOURCES;LINK" ${ARGN})
  add_executable(${name} ${ARG_SOURCES})
  target_link_libraries(${name} PRIVATE tandem_flags ${ARG_LINK} tandem_test_support GTest::gmock GTest::gtest_main)
  target_compile_options(${name} PRIVATE ${tandem_test_options})
  tandem_use_precompiled(${name} tandem_precompiled_tests)

  set(labels asan)
  if(ARG_THREADS)
    list(APPEND labels tsan)
  endif()
  if(ARG_NUMERIC)
    list(TRANSFORM labels APPEND -${tandem_night})
  elseif(ARG_SLOW)
    set(labels "")
  endif()
  if(TANDEM_SANITIZE AND ARG_NUMERIC_CASES)
    list(JOIN ARG_NUMERIC_CASES ":" numeric)
    list(JOIN ARG_NIGHTLY ":" nightly)
    tandem_run_cases(${name} ${name} "*-${numeric}:${nightly}" "${labels}")
    list(TRANSFORM labels APPEND -${tandem_night})
    tandem_run_cases(${name}.numeric ${name} "${numeric}-${nightly}" "${labels}")
    return()
  endif()
  list(JOIN ARG_NIGHTLY ":" nightly)
  if(NOT nightly)
    tandem_run_cases(${name} ${name} "*" "${labels}")
    tandem_begin_early(${name} "${ARG_SLOW}")
    return()
  endif()
  if(NOT nightly STREQUAL "*")
    tandem_run_cases(${name} ${name} "*-${nightly}" "${labels}")
    tandem_begin_early(${name} "${ARG_SLOW}")
  endif()
  tandem_run_cases(${name}.nightly ${name} "${nightly}" nightly)
endfunction()
