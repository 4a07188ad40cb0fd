# Completion of `vantage` for bash: source <(vantage completion bash)
# It knows no job and no option: each program is asked (`vantage JOB __complete`) what can follow it.

# What `$value` ("file", "{a,b}", ...) can be, beginning with `$current`, into COMPREPLY.
_vantage_values() {
  local value=$1 current=$2
  case $value in
    file)
      compopt -o filenames 2>/dev/null
      mapfile -t COMPREPLY < <(compgen -f -- "$current") ;;
    dir)
      compopt -o filenames 2>/dev/null
      mapfile -t COMPREPLY < <(compgen -d -- "$current") ;;
    plugin)
      mapfile -t COMPREPLY < <(compgen -W "$("$program" plugins list --names 2>/dev/null)" -- "$current") ;;
    '{'*'}')
      value=${value#'{'}
      value=${value%'}'}
      mapfile -t COMPREPLY < <(compgen -W "${value//,/ }" -- "$current") ;;
  esac
}

_vantage() {
  local program=${COMP_WORDS[0]/#\~/$HOME} current=${COMP_WORDS[COMP_CWORD]}
  COMPREPLY=()

  # bash makes three words of --color=never.
  local -a words=()
  local i word
  for ((i = 1; i < COMP_CWORD; ++i)); do
    word=${COMP_WORDS[i]}
    [[ $word == '=' ]] || words+=("$word")
  done
  [[ $current == '=' ]] && current=

  local job=
  if ((${#words[@]} > 0)); then
    job=${words[0]}
    words=("${words[@]:1}")
    [[ $job == -* ]] && return
  fi
  local table
  if [[ -z $job ]]; then
    table=$("$program" __complete 2>/dev/null)
  else
    table=$("$program" "$job" __complete 2>/dev/null) || table=
  fi
  if [[ -z $table ]]; then
    _vantage_values file "$current"
    return
  fi

  # By name: what of the subcommand at hand takes which value.
  local -A values=()
  local -a names=() arguments=() commands=()
  local last_many=one
  _vantage_scope() {
    local scope=$1 of what name value many help
    values=() names=() arguments=() commands=() last_many=one
    while IFS=$'\t' read -r of what name value many help; do
      [[ $of == "$scope" ]] || continue
      case $what in
        command) commands+=("$name") ;;
        argument) arguments+=("$value"); last_many=$many ;;
        *)
          local one
          for one in ${name//,/ }; do
            names+=("$one")
            values[$one]=$value
          done ;;
      esac
    done <<<"$table"
  }
  _vantage_scope .

  local pending=none given=0 known
  for word in ${words[@]+"${words[@]}"}; do
    if [[ $pending != none ]]; then
      pending=none
    elif [[ $word == -* ]]; then
      pending=${values[$word]:-none}
    else
      for known in ${commands[@]+"${commands[@]}"}; do
        if [[ $word == "$known" ]]; then
          _vantage_scope "$word"
          given=-1
          break
        fi
      done
      ((++given))
    fi
  done

  if [[ $pending != none ]]; then
    _vantage_values "$pending" "$current"
  elif [[ $current == -* ]]; then
    mapfile -t COMPREPLY < <(compgen -W "${names[*]}" -- "$current")
  elif ((${#commands[@]} > 0)); then
    mapfile -t COMPREPLY < <(compgen -W "${commands[*]}" -- "$current")
  elif ((given < ${#arguments[@]})); then
    _vantage_values "${arguments[given]}" "$current"
  elif ((${#arguments[@]} > 0)) && [[ $last_many == many ]]; then
    _vantage_values "${arguments[-1]}" "$current"
  fi
}

complete -F _vantage vantage
