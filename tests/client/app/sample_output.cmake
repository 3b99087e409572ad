# Runs PROGRAM. Passes if it exits with 0, and its output contains ROW and ends with LAST_ROW (regular expressions).
# CTest alone checks either the output or the exit code, never both.
execute_process(COMMAND ${PROGRAM} RESULT_VARIABLE code OUTPUT_VARIABLE out ERROR_VARIABLE err TIMEOUT 60)
if(NOT code STREQUAL 0)
  message(FATAL_ERROR "exit code ${code}\n${out}${err}")
endif()
if(NOT out MATCHES "\n${ROW}\n")
  message(FATAL_ERROR "no row like '${ROW}' in\n${out}")
endif()
if(NOT out MATCHES "\n${LAST_ROW}\n$")
  message(FATAL_ERROR "the last row is not like '${LAST_ROW}' in\n${out}")
endif()
