# Runs PROGRAM with ARGUMENTS (a list). Passes if it exits with CODE and prints EXPECTED in one line on stderr.
execute_process(COMMAND ${PROGRAM} ${ARGUMENTS} RESULT_VARIABLE code OUTPUT_VARIABLE out ERROR_VARIABLE err TIMEOUT 60)
if(NOT code STREQUAL CODE)
  message(FATAL_ERROR "exit code ${code}, expected ${CODE}\n${out}${err}")
endif()
if(EXPECTED AND NOT err MATCHES "^[^\n]*${EXPECTED}[^\n]*\n$")
  message(FATAL_ERROR "expected one line with '${EXPECTED}' on stderr, got:\n${err}")
endif()
