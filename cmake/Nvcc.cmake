# Copyright the photoslam authors.
# SPDX-License-Identifier: Apache-2.0
# Finds nvcc 12.0 or newer and says how to call it, for module and device tests: PHOTOSLAM_NVCC, empty where there is
# none, and photoslam_nvcc(<output> SOURCES <file>... [OPTIONS <option>...] [LINK <static library target>...]).
find_program(PHOTOSLAM_NVCC nvcc HINTS ENV CUDA_HOME ENV CUDA_PATH /usr/local/cuda PATH_SUFFIXES bin)
set(nvcc_release 0)
if(PHOTOSLAM_NVCC)
  execute_process(COMMAND ${PHOTOSLAM_NVCC} --version OUTPUT_VARIABLE nvcc_release)
  string(REGEX REPLACE ".*release ([0-9.]+).*" "\\1" nvcc_release "${nvcc_release}")
endif()
if(nvcc_release VERSION_LESS 12.0)
  set(PHOTOSLAM_NVCC "")
endif()

# Turing, Ampere (two), Jetson Orin, Ada, Hopper, Blackwell; newer GPUs compile the PTX of the last.
set(PHOTOSLAM_CUDA_ARCHITECTURES "" CACHE STRING "Compute capabilities to compile for, as in 75;90; empty: all")
set(nvcc_architectures ${PHOTOSLAM_CUDA_ARCHITECTURES})
if(NOT nvcc_architectures)
  set(nvcc_architectures 75 80 86 87 89 90)
  if(nvcc_release VERSION_GREATER_EQUAL 12.8)
    list(APPEND nvcc_architectures 100)
  endif()
endif()
set(nvcc_flags -std=c++20 -O3 -Xcompiler=-fPIC,-Wall,-Wextra,-Wshadow)
foreach(architecture ${nvcc_architectures})
  list(APPEND nvcc_flags -gencode arch=compute_${architecture},code=sm_${architecture})
endforeach()
list(GET nvcc_architectures -1 architecture)
list(APPEND nvcc_flags -gencode arch=compute_${architecture},code=compute_${architecture})

function(photoslam_nvcc output)
  cmake_parse_arguments(ARG "" "" "SOURCES;OPTIONS;LINK" ${ARGN})
  get_filename_component(name ${output} NAME)
  set(objects)
  foreach(source ${ARG_SOURCES})
    get_filename_component(stem ${source} NAME_WE)
    set(object ${CMAKE_CURRENT_BINARY_DIR}/${name}.${stem}.o)
    add_custom_command(
      OUTPUT ${object}
      COMMAND ${PHOTOSLAM_NVCC} ${nvcc_flags} ${ARG_OPTIONS} -MD -MF ${object}.d -MT ${object} -x cu -c ${source} -o ${object}
      DEPENDS ${source}
      DEPFILE ${object}.d
      COMMENT "Compiling ${name}: ${stem} for GPUs of ${nvcc_architectures}"
      VERBATIM)
    list(APPEND objects ${object})
  endforeach()
  set(libraries)
  foreach(target ${ARG_LINK})
    list(APPEND libraries $<TARGET_FILE:${target}>)
  endforeach()
  set(shared)
  if(output MATCHES "\\.so$")
    set(shared -shared)
  endif()
  add_custom_command(
    OUTPUT ${output}
    COMMAND ${PHOTOSLAM_NVCC} ${nvcc_flags} ${shared} -cudart static ${objects} ${libraries} -o ${output}
    DEPENDS ${objects} ${ARG_LINK}
    COMMENT "Linking ${name}"
    VERBATIM)
endfunction()
