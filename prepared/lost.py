"""lost.py: files that use a name of a header which they do not reach any more, comparing HEAD with the working copy. Names are guessed from text."""
import re, subprocess, pathlib, sys
def tree(at_head):
    if at_head:
        names = subprocess.run(["git","ls-tree","-r","--name-only","HEAD"],capture_output=True,text=True).stdout.split()
    else:
        names = subprocess.run(["git","ls-files","--cached","--others","--exclude-standard"],capture_output=True,text=True).stdout.split()
    names=[n for n in names if n.endswith((".cpp",".hpp"))]
    if at_head:
        import io, tarfile
        tar=tarfile.open(fileobj=io.BytesIO(subprocess.run(["git","archive","HEAD"],capture_output=True).stdout))
        return {n: tar.extractfile(n).read().decode() for n in names}
    return {n: pathlib.Path(n).read_text() for n in names if pathlib.Path(n).exists()}
INC=re.compile(r'^#include "([^"]+)"',re.M)
NAME=re.compile(r'^(?:\[\[nodiscard\]\] )?(?:inline |constexpr |template <[^>]*>\s*)*(?:struct|class|enum class|enum|using)\s+(\w+)|^(?:\[\[nodiscard\]\] )?(?:inline |constexpr |static )*[\w:<>,&* ]+?\b(\w+)\s*(?:\(|=|\{)',re.M)
def direct(f,t): 
    out=[]
    for i in INC.findall(t[f]):
        if i in t: out.append(i)
        else:
            b=str(pathlib.PurePath(f).parent/i)
            if b in t: out.append(b)
    return out
def closure(t):
    d={f:direct(f,t) for f in t}
    memo={}
    def go(f):
        seen=set(); stack=[f]
        while stack:
            x=stack.pop()
            for y in d.get(x,()):
                if y not in seen: seen.add(y); stack.append(y)
        return seen
    return {f:go(f) for f in t}
def names(text):
    text=re.sub(r'//.*','',text)
    return {a or b for a,b in NAME.findall(text)}-{"if","for","return","while","switch","static_assert","namespace","friend"}
old,new=tree(True),tree(False)
co,cn=closure(old),closure(new)
where={}
for f,t in new.items():
    if f.endswith(".hpp"):
        for n in names(t): where.setdefault(n,set()).add(f)
for f in sorted(new):
    if f not in co: reach=cn[f]; continue
    lost=co[f]-cn[f]
    if not lost: continue
    body=re.sub(r'//.*','',new[f]); words=set(re.findall(r'\w+',body))
    for h in sorted(lost):
        if h not in new: continue
        used=[n for n in names(new[h]) & words if not (where[n]&(cn[f]|{f}))]
        used=[n for n in used if (n[0].isupper() and len(n)>2) or re.search(rf"\b{n}\(", body) and len(n)>3 or n.endswith(("_max","_min","_s","_mA"))]
        if used: print(f"{f}: {h}: {sorted(used)}")
STD=re.compile(r'^#include <([^>]+)>',re.M)
def std(t,c): 
    own={f:set(STD.findall(x)) for f,x in t.items()}
    return {f: own[f].union(*(own[g] for g in c[f])) if c[f] else own[f] for f in t}
so,sn=std(old,co),std(new,cn)
NEED={"cmath":r"std::(abs|sqrt|isfinite|isnan|exp|log|pow|lround|llround|round|floor|ceil|hypot|asinh|fabs|copysign)\b","cstdlib":r"std::(abs|strtol|getenv|exit)\b","array":r"std::(array|to_array)\b","optional":r"std::(optional|nullopt)","string_view":r"string_view","string":r"std::(string|to_string)\b","vector":r"std::vector","algorithm":r"std::(min|max|clamp|find|any_of|all_of|count|sort|copy|fill|max_element|min_element|find_if|count_if|ranges)\b","limits":r"numeric_limits","span":r"std::span","cstdint":r"u?int\d+_t|INT\d+_M","cstddef":r"std::size_t","functional":r"std::function","tuple":r"std::(tuple|tie|get)\b","utility":r"std::(move|pair|swap|exchange|forward)\b","variant":r"std::variant","chrono":r"std::chrono","numeric":r"std::(accumulate|iota)","memory":r"std::unique_ptr","type_traits":r"std::(is_|decay|remove_)","bit":r"std::(bit_cast|popcount|countr)"}
print("--- standard headers")
for f in sorted(new):
    if f not in old: continue
    for h in so[f]-sn[f]:
        if h in NEED and re.search(NEED[h], new[f]): print(f"{f}: <{h}> {re.search(NEED[h],new[f]).group()}")
print("--- macros")
for f in sorted(new):
    for m,h in (("BMU_FIELDS","protocol/fields.hpp"),("is_within(","protocol/fields.hpp"),("BMU_ASSERT","protocol/assert.hpp")):
        if m in re.sub(r'//.*','',new[f]) and h in new and h!=f and h not in cn[f] and f.startswith("daemon"): print(f,m)
