"""Which adapter computes, with its limits. All other steps need this one."""

import json
import subprocess

from .session import Failure, Step


def find_device(session):
    listed = json.loads(session.swell("inspect", "--adapters", "--json").stdout)["adapters"]
    if not listed:
        raise Failure("swell finds no adapter: is a Vulkan driver installed?")
    scene = ("inspect", "scenes/dam-break.toml", "--json")
    used = json.loads(session.swell(*scene).stdout)["adapter"]
    adapter = next((each for each in listed if each["name"] == used), None)
    if adapter is None:
        raise Failure(f"no adapter is listed by the name of the one that is used, {used}")
    version = session.swell("--version").stdout.split("\n")
    session.device = {
        **adapter,
        "adapters": listed,
        "swell": version[0].replace("swell ", ""),
        "commit": next((line[8:16] for line in version if line.startswith("commit: ")), None),
        "nvidia_smi": ask_nvidia(),
    }
    if is_software(adapter) and not session.software:
        raise Failure(f"{adapter['name']} is a software adapter; --software accepts it")
    return {"summary": f"{adapter['name']}, {adapter['kind']}, {adapter['driver']}"}


def is_software(adapter):
    words = f"{adapter['name']} {adapter['kind']}".lower()
    return any(word in words for word in ("cpu", "llvmpipe", "swiftshader"))


def ask_nvidia():
    """Name, driver, memory and clocks as NVIDIA's tool prints them, or None."""
    fields = "name,driver_version,memory.total,clocks.max.sm,clocks.max.mem,power.limit"
    command = ["nvidia-smi", f"--query-gpu={fields}", "--format=csv,noheader"]
    try:
        ran = subprocess.run(command, capture_output=True, text=True, timeout=20, check=True)
    except (OSError, subprocess.SubprocessError):
        return None
    return ran.stdout.strip()


STEP = Step("device", "adapter", 60, find_device)
