#!/usr/bin/env python3
"""Commits one error in the use of Vulkan, which a validation layer has to report: the negative control of
tools/lib/drivers validation.

    vulkan_fault.py nothing    two fills of a buffer with a barrier between them
    vulkan_fault.py hazard     the same without the barrier, which only synchronization validation sees
    vulkan_fault.py submits    the same in two submissions, each of one fill
    vulkan_fault.py argument   a fill whose offset is no multiple of four
"""

import ctypes
import sys
from ctypes import POINTER, byref, c_char_p, c_float, c_uint32, c_uint64, c_void_p


def structure(*fields):
    """A Vulkan structure; one that begins with `type` starts with that number and the pointer to its extension."""
    return type("Structure", (ctypes.Structure,), {"_fields_": list(fields)})


HEAD = ("type", c_uint32), ("next", c_void_p)
Application = structure(
    *HEAD, ("name", c_char_p), ("version", c_uint32), ("engine", c_char_p), ("engine_version", c_uint32), ("api", c_uint32)
)
NAMES = [(name, kind) for part in ("layer", "extension") for name, kind in ((f"{part}s", c_uint32), (f"{part}_names", c_void_p))]
InstanceInfo = structure(*HEAD, ("flags", c_uint32), ("application", POINTER(Application)), *NAMES)
QueueInfo = structure(
    *HEAD, ("flags", c_uint32), ("family", c_uint32), ("count", c_uint32), ("priorities", POINTER(c_float))
)
DeviceInfo = structure(
    *HEAD, ("flags", c_uint32), ("queues", c_uint32), ("queue_infos", POINTER(QueueInfo)), *NAMES, ("features", c_void_p)
)
BufferInfo = structure(
    *HEAD, ("flags", c_uint32), ("size", c_uint64), ("usage", c_uint32), ("sharing", c_uint32),
    ("families", c_uint32), ("family_indices", c_void_p),
)
Requirements = structure(("size", c_uint64), ("alignment", c_uint64), ("memory_types", c_uint32))
AllocateInfo = structure(*HEAD, ("size", c_uint64), ("memory_type", c_uint32))
PoolInfo = structure(*HEAD, ("flags", c_uint32), ("family", c_uint32))
CommandInfo = structure(*HEAD, ("pool", c_uint64), ("level", c_uint32), ("count", c_uint32))
BeginInfo = structure(*HEAD, ("flags", c_uint32), ("inheritance", c_void_p))
SubmitInfo = structure(
    *HEAD, ("waits", c_uint32), ("wait_semaphores", c_void_p), ("wait_stages", c_void_p), ("commands", c_uint32),
    ("command_buffers", POINTER(c_void_p)), ("signals", c_uint32), ("signal_semaphores", c_void_p),
)
Barrier = structure(*HEAD, ("source", c_uint32), ("destination", c_uint32))

TRANSFER_STAGE, TRANSFER_WRITE, TRANSFER_DESTINATION, ONE_TIME_SUBMIT = 0x1000, 0x1000, 2, 1
SIZE = 1024


def call(name, *arguments):
    code = getattr(vulkan, name)(*arguments)
    if code:
        sys.exit(f"{name}: {code}")


def made(name, parent, info):
    """What a vkCreate function makes."""
    handle = c_uint64()
    call(name, parent, byref(info), None, byref(handle))
    return handle


fault = sys.argv[1] if len(sys.argv) == 2 else None
if fault not in ("nothing", "hazard", "submits", "argument"):
    print(__doc__, file=sys.stderr)
    sys.exit(2)
vulkan = ctypes.CDLL("libvulkan.so.1")
instance, physical, device = c_void_p(), c_void_p(), c_void_p()
application = Application(type=0, api=1 << 22 | 1 << 12)
call("vkCreateInstance", byref(InstanceInfo(type=1, application=ctypes.pointer(application))), None, byref(instance))
vulkan.vkEnumeratePhysicalDevices(instance, byref(c_uint32(1)), byref(physical))
queue_info = QueueInfo(type=2, count=1, priorities=ctypes.pointer(c_float(1)))
call("vkCreateDevice", physical, byref(DeviceInfo(type=3, queues=1, queue_infos=ctypes.pointer(queue_info))), None, byref(device))
buffer = made("vkCreateBuffer", device, BufferInfo(type=12, size=SIZE, usage=TRANSFER_DESTINATION))
needs = Requirements()
vulkan.vkGetBufferMemoryRequirements(device, buffer, byref(needs))
lowest = (needs.memory_types & -needs.memory_types).bit_length() - 1
memory = made("vkAllocateMemory", device, AllocateInfo(type=5, size=needs.size, memory_type=lowest))
call("vkBindBufferMemory", device, buffer, memory, c_uint64(0))
pool = made("vkCreateCommandPool", device, PoolInfo(type=39))
commands = (c_void_p * 2)()
call("vkAllocateCommandBuffers", device, byref(CommandInfo(type=40, pool=pool, count=2)), commands)
queue = c_void_p()
vulkan.vkGetDeviceQueue(device, 0, 0, byref(queue))


def fill(command, offset=0):
    vulkan.vkCmdFillBuffer(command, buffer, c_uint64(offset), c_uint64(SIZE // 2), c_uint32(1))


def submit(command):
    call("vkEndCommandBuffer", command)
    info = SubmitInfo(type=4, commands=1, command_buffers=ctypes.pointer(command))
    call("vkQueueSubmit", queue, 1, byref(info), c_uint64(0))


first, second = (c_void_p(handle) for handle in commands)
for command in first, second:
    call("vkBeginCommandBuffer", command, byref(BeginInfo(type=42, flags=ONE_TIME_SUBMIT)))
fill(first)
if fault in ("nothing", "argument"):
    barrier = Barrier(type=46, source=TRANSFER_WRITE, destination=TRANSFER_WRITE)
    stages = c_uint32(TRANSFER_STAGE), c_uint32(TRANSFER_STAGE)
    vulkan.vkCmdPipelineBarrier(first, *stages, 0, 1, byref(barrier), 0, None, 0, None)
fill(second if fault == "submits" else first, offset=2 if fault == "argument" else 0)
submit(first)
submit(second)
call("vkQueueWaitIdle", queue)
for name, handle in ("vkDestroyCommandPool", pool), ("vkDestroyBuffer", buffer), ("vkFreeMemory", memory):
    getattr(vulkan, name)(device, handle, None)
vulkan.vkDestroyDevice(device, None)
vulkan.vkDestroyInstance(instance, None)
