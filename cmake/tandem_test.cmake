# Defines how tests are built and when they run. `deploy/test` runs all tests except those labelled `nightly`.
#
# label           run by, and how compiled
# asan, tsan      .ci/run; with AddressSanitizer and UndefinedBehaviorSanitizer, or with ThreadSanitizer
# nightly         deploy/nightly; optimised. These are tests that take minutes
# asan-nightly, tsan-nightly, asan-lab, tsan-lab
#                 deploy/nightly; as asan and tsan. These are tests of code without input from outside, and of the lab
#
# The target LABEL_tests builds all programs that the tests with a sanitizer's label need.
foreach(label asan tsan asan-nightly tsan-nightly asan-lab tsan-lab)
  add_custom_target(${label}_tests)
endforeach()

# Nightly part that runs the NUMERIC tests of this folder under sanitizers: nightly or lab.
set(tandem_night nightly)

# Results of tests do not depend on their speed, and compiling with -O1 takes two thirds of the time.
set(tandem_test_options $<$<CONFIG:Release>:-O1>)
if(TANDEM_PCH)
  tandem_precompiled(tandem_precompiled_tests
    LINK Eigen3::Eigen Boost::headers GTest::gmock
    OPTIONS ${tandem_test_options}
    HEADERS ${tandem_common_headers} <gmock/gmock.h> <gtest/gtest.h>)
endif()
# Assets built from meshes and the keys of servers are stored between tests, separate from the user's own. Claims that
# cannot be tested on this machine are appended to left_out.txt.
set(tandem_test_environment
  "TANDEM_CACHE=${PROJECT_BINARY_DIR}/cache;TANDEM_STATE=${PROJECT_BINARY_DIR}/state;TANDEM_LEFT_OUT=${PROJECT_BINARY_DIR}/left_out.txt")
# A sanitizer makes numerical code up to a hundred times slower.
set(tandem_test_timeout 900)
if(TANDEM_SANITIZE)
  set(tandem_test_timeout 1800)
endif()

# tandem_run_test(NAME LABELS ... NEEDS targets COMMAND ...): adds one ctest entry.
function(tandem_run_test name)
  # Arguments are parsed by position, so that an argument of the command may be a list.
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

# Adds an entry that runs some cases of a GoogleTest program. It fails if no case matches the filter.
function(tandem_run_cases name program filter labels)
  tandem_run_test(${name} LABELS ${labels} NEEDS ${program}
    COMMAND ${program} --gtest_brief=1 "--gtest_filter=${filter}")
  set_tests_properties(${name} PROPERTIES FAIL_REGULAR_EXPRESSION " 0 tests from 0 test suites ran")
endfunction()

# Slow tests start first, so that no core waits for them at the end.
function(tandem_begin_early name is_slow)
  if(is_slow)
    set_tests_properties(${name} PROPERTIES COST 90)
  endif()
endfunction()

# tandem_test(NAME [SLOW|NUMERIC] [THREADS] [NIGHTLY Suite.Case ...] [NUMERIC_CASES Suite.Case ...] SOURCES ... LINK
# ...): adds one GoogleTest program and one ctest entry. A failure names the case. NIGHTLY: patterns as for
# --gtest_filter; these cases are excluded from that entry and run as NAME.nightly. THREADS: the test uses several
# threads. NUMERIC: the test gets no bytes from outside, so it runs under sanitizers only at night. NUMERIC_CASES: the
# same for some cases (NAME.numeric). SLOW: the test never runs under sanitizers.
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
