! For authors of laws in Fortran: the contract of pilum_law.h as a module, and what every law does
! alike. The first part mirrors the structs; a test compares sizes and offsets with the header. The
! second part describes one law, checks its parameters, walks the batch, and writes outcomes and
! the message; what is left to the author is a description and a subroutine that carries one point
! over one increment.
!
! `stop`, `error stop` and failing I/O end the host: return a status and a reason instead. Compile
! with -frecursive, so that no local variable is shared between threads.
module pilum
  use, intrinsic :: iso_c_binding
  implicit none
  public

  integer, parameter :: dp = c_double

  ! ---- the contract ------------------------------------------------------------------------------

  integer(c_int32_t), parameter :: PILUM_MAGIC_NUMBER = int(z'50494C4D', c_int32_t)
  integer(c_int16_t), parameter :: PILUM_ABI_MAJOR = 1
  integer(c_int16_t), parameter :: PILUM_ABI_MINOR = 0
  integer(c_int64_t), parameter :: PILUM_LAYOUT_HASH = int(z'35BE1D04C1C21612', c_int64_t)

  integer(c_int32_t), parameter :: PILUM_OK = 0
  integer(c_int32_t), parameter :: PILUM_OK_UNRELIABLE = 1
  integer(c_int32_t), parameter :: PILUM_CUT_STEP = 2
  integer(c_int32_t), parameter :: PILUM_E_ARGUMENT = -1
  integer(c_int32_t), parameter :: PILUM_E_PARAMETER = -2
  integer(c_int32_t), parameter :: PILUM_E_UNSUPPORTED = -3
  integer(c_int32_t), parameter :: PILUM_E_DOMAIN = -4
  integer(c_int32_t), parameter :: PILUM_E_NUMERIC = -5
  integer(c_int32_t), parameter :: PILUM_E_INTERNAL = -6

  integer(c_int32_t), parameter :: PILUM_H_PLANE_STRAIN = 1
  integer(c_int32_t), parameter :: PILUM_H_AXISYMMETRIC = 2
  integer(c_int32_t), parameter :: PILUM_H_3D = 3
  integer(c_int32_t), parameter :: PILUM_H_INTERFACE_2D = 10

  integer(c_int32_t), parameter :: PILUM_SCALAR = 0
  integer(c_int32_t), parameter :: PILUM_VECTOR = 1
  integer(c_int32_t), parameter :: PILUM_SYMMETRIC_TENSOR = 2

  integer(c_int32_t), parameter :: PILUM_P_OPEN_LOWER = 1
  integer(c_int32_t), parameter :: PILUM_P_OPEN_UPPER = 2
  integer(c_int32_t), parameter :: PILUM_P_OPTIONAL = 4
  integer(c_int32_t), parameter :: PILUM_V_OUTPUT_ONLY = 1
  integer(c_int32_t), parameter :: PILUM_T_SYMMETRIC = 1
  integer(c_int32_t), parameter :: PILUM_T_LINEAR = 2
  integer(c_int32_t), parameter :: PILUM_T_LOCAL_AXES = 4
  integer(c_int32_t), parameter :: PILUM_REQ_FLUX = 1
  integer(c_int32_t), parameter :: PILUM_REQ_TANGENT = 2
  integer(c_int32_t), parameter :: PILUM_REQ_ELASTIC = 4

  type, bind(C) :: pilum_magic_block
    integer(c_int32_t) :: struct_size, magic
    integer(c_int16_t) :: abi_major, abi_minor
    integer(c_int8_t) :: pointer_bytes, real_bytes, reserved(2)
    integer(c_int64_t) :: layout_hash
    character(kind=c_char) :: sdk(40)
  end type

  type, bind(C) :: pilum_parameter
    integer(c_int32_t) :: struct_size, flags
    type(c_ptr) :: id, symbol, unit, doc
    real(c_double) :: default_value, lower, upper, usual_lower, usual_upper
    type(c_ptr) :: choices
  end type

  type, bind(C) :: pilum_variable
    integer(c_int32_t) :: struct_size, flags
    type(c_ptr) :: id, symbol, unit, doc
    integer(c_int32_t) :: shape, n_components
    type(c_ptr) :: component_names
    real(c_double) :: initial_value
  end type

  type, bind(C) :: pilum_formulation
    integer(c_int32_t) :: struct_size, hypothesis, flags, n_gradients, n_fluxes, n_states
    type(c_ptr) :: gradient, flux, state
  end type

  type, bind(C) :: pilum_view
    type(c_ptr) :: p
    integer(c_intptr_t) :: point, component
  end type

  type, bind(C) :: pilum_view_mut
    type(c_ptr) :: p
    integer(c_intptr_t) :: point, component
  end type

  type, bind(C) :: pilum_batch
    integer(c_int32_t) :: struct_size, request
    integer(c_int64_t) :: n_points, first_point
    real(c_double) :: time, time_increment
    type(pilum_view) :: gradient0, gradient1, flux0, state0
    type(pilum_view_mut) :: flux1, state1, tangent
    type(c_ptr) :: status, step_factor, message
    integer(c_size_t) :: message_capacity
  end type

  type, bind(C) :: pilum_host
    integer(c_int32_t) :: struct_size
    integer(c_int16_t) :: abi_major, abi_minor
    type(c_ptr) :: name, version
    type(c_funptr) :: get_extension
  end type

  type, bind(C) :: pilum_law
    integer(c_int32_t) :: struct_size, flags, n_parameters, n_formulations
    type(c_ptr) :: id, name, version, author, licence, doc, references, parameter, formulation
    type(c_funptr) :: create, init_state, integrate, destroy
  end type

  type, bind(C) :: pilum_plugin
    integer(c_int32_t) :: struct_size, n_laws
    type(c_ptr) :: law
    type(c_funptr) :: get_extension
  end type

  ! ---- what an author writes ---------------------------------------------------------------------

  integer, parameter :: MAX_COMPONENTS = 6, MAX_PARAMETERS = 64, MAX_STATES = 64
  integer, parameter :: MAX_FORMULATIONS = 4

  ! Which operator the host wants beside the update.
  integer, parameter :: TANGENT_NONE = 0, TANGENT_ELASTIC = 1, TANGENT_CONSISTENT = 2

  ! One integration point at the start of an increment, and the increment.
  type :: point_type
    ! Number of components: 2 for interfaces, 4 for solids in the plane, 6 in space.
    integer :: n
    ! Strain or jump at the start, its increment, stress or traction at the start (kPa).
    real(dp) :: gradient(MAX_COMPONENTS), increment(MAX_COMPONENTS), flux(MAX_COMPONENTS)
    ! Internal variables at the start.
    real(dp) :: state(MAX_STATES)
    real(dp) :: time, time_increment
  end type

  ! The same point at the end of the increment; all zero when the author receives it.
  type :: response_type
    real(dp) :: flux(MAX_COMPONENTS)
    real(dp) :: state(MAX_STATES)
    ! tangent(i, j) = d flux(i) / d gradient(j), as DDSDDE(i, j).
    real(dp) :: tangent(MAX_COMPONENTS, MAX_COMPONENTS)
    ! With any outcome but PILUM_OK: why.
    character(len=120) :: reason
    ! With PILUM_CUT_STEP: the fraction of the increment that the law can follow; NaN: the host's choice.
    real(dp) :: step_factor
  end type

  abstract interface
    ! Looks at the parameters, each within its bounds already, and may put into `p` what the update
    ! needs instead. A text in `refusal` refuses them: `id: value is above ...`.
    subroutine prepare_interface(p, refusal)
      import :: dp
      real(dp), intent(inout) :: p(:)
      character(len=*), intent(inout) :: refusal
    end subroutine

    ! Carries one point over one increment; `p` is what `prepare` left. A pure function of its
    ! arguments: no saved variables, no I/O, no allocation.
    subroutine update_interface(p, point, tangent, end, status)
      import :: dp, point_type, response_type, c_int32_t
      real(dp), intent(in) :: p(:)
      type(point_type), intent(in) :: point
      integer, intent(in) :: tangent
      type(response_type), intent(inout) :: end
      integer(c_int32_t), intent(inout) :: status
    end subroutine
  end interface

  ! ---- the one law of this library ---------------------------------------------------------------

  integer(c_int64_t), parameter, private :: NAN_BITS = int(z'7FF8000000000000', c_int64_t)
  integer(c_int64_t), parameter, private :: INFINITY_BITS = int(z'7FF0000000000000', c_int64_t)
  real(dp), parameter, private :: NAN = transfer(NAN_BITS, 1.0_dp)
  real(dp), parameter, private :: INFINITY = transfer(INFINITY_BITS, 1.0_dp)
  character(len=*), parameter, private :: SDK_NAME = 'pilum-fortran 1.0'
  integer, private :: sdk_letter

  type(pilum_magic_block), bind(C, name='pilum_magic'), target, save :: pilum_magic = &
    pilum_magic_block(64, PILUM_MAGIC_NUMBER, PILUM_ABI_MAJOR, PILUM_ABI_MINOR, 8_c_int8_t, &
    8_c_int8_t, 0_c_int8_t, PILUM_LAYOUT_HASH, &
    [(SDK_NAME(sdk_letter:sdk_letter), sdk_letter=1, len(SDK_NAME)), &
    (c_null_char, sdk_letter=len(SDK_NAME) + 1, 40)])

  ! Static: the host keeps pointers into all of it. It is filled by the first call of the entry,
  ! which must be over before another begins; the Pilum host opens libraries one at a time.
  character(kind=c_char), target, save, private :: texts(16384)
  integer, save, private :: n_texts = 0
  type(pilum_parameter), target, save, private :: parameters(MAX_PARAMETERS)
  type(pilum_variable), target, save, private :: states(MAX_STATES)
  type(pilum_variable), target, save, private :: gradients(MAX_FORMULATIONS)
  type(pilum_variable), target, save, private :: fluxes(MAX_FORMULATIONS)
  type(c_ptr), target, save, private :: component_names(MAX_COMPONENTS, MAX_FORMULATIONS)
  type(pilum_formulation), target, save, private :: formulations(MAX_FORMULATIONS)
  type(pilum_law), target, save, private :: the_law
  type(c_ptr), target, save, private :: the_laws(1)
  type(pilum_plugin), target, save, private :: the_plugin
  procedure(prepare_interface), pointer, save, private :: the_prepare => null()
  procedure(update_interface), pointer, save, private :: the_update => null()
  logical, save, private :: is_described = .false.

  ! What an instance holds.
  type, private :: instance_type
    real(dp) :: p(MAX_PARAMETERS)
    integer :: n_parameters, n_components, n_states
  end type

  private :: text, say, point_says, create, integrate, destroy, element, is_finite, is_worse

contains

  ! Whether the description is complete: the entry describes the law once.
  logical function described()
    described = is_described
  end function

  ! Names the law and its subroutines; its parameters, internal variables and formulations follow.
  subroutine describe_law(id, name, version, author, licence, doc, references, prepare, update)
    character(len=*), intent(in) :: id, name, version, author, licence, doc, references
    procedure(prepare_interface) :: prepare
    procedure(update_interface) :: update
    the_prepare => prepare
    the_update => update
    the_law = pilum_law(int(c_sizeof(the_law), c_int32_t), 0, 0, 0, text(id), text(name), &
      text(version), text(author), text(licence), text(doc), text(references), &
      c_loc(parameters), c_loc(formulations), c_funloc(create), c_null_funptr, &
      c_funloc(integrate), c_funloc(destroy))
  end subroutine

  ! Declares the next parameter. Bounds are inclusive: `lower <= value <= upper`; `above`, `below`
  ! exclude the bound itself. Values outside `usual` draw a warning.
  subroutine add_parameter(id, symbol, unit, doc, lower, upper, above, below, usual, default)
    character(len=*), intent(in) :: id, symbol, unit, doc
    real(dp), intent(in), optional :: lower, upper, above, below, usual(2), default
    type(pilum_parameter) :: new
    if (the_law%n_parameters >= MAX_PARAMETERS) return
    new = pilum_parameter(int(c_sizeof(new), c_int32_t), 0, text(id), text(symbol), text(unit), &
      text(doc), NAN, -INFINITY, INFINITY, -INFINITY, INFINITY, c_null_ptr)
    if (present(lower)) new%lower = lower
    if (present(upper)) new%upper = upper
    if (present(above)) then
      new%lower = above
      new%flags = ior(new%flags, PILUM_P_OPEN_LOWER)
    end if
    if (present(below)) then
      new%upper = below
      new%flags = ior(new%flags, PILUM_P_OPEN_UPPER)
    end if
    if (present(usual)) then
      new%usual_lower = usual(1)
      new%usual_upper = usual(2)
    end if
    if (present(default)) new%default_value = default
    the_law%n_parameters = the_law%n_parameters + 1
    parameters(the_law%n_parameters) = new
  end subroutine

  ! Declares the internal variables, all numbers, before the formulations. 0 at first.
  subroutine add_state(number, id, symbol, unit, doc)
    integer, intent(in) :: number
    character(len=*), intent(in) :: id, symbol, unit, doc
    if (number < 1 .or. number > MAX_STATES) return
    states(number) = pilum_variable(int(c_sizeof(states(1)), c_int32_t), 0, text(id), &
      text(symbol), text(unit), text(doc), PILUM_SCALAR, 1, c_null_ptr, 0.0_dp)
  end subroutine

  ! Declares a hypothesis that the law offers, with its first `n_states` internal variables.
  subroutine add_formulation(hypothesis, n_states, flags)
    integer(c_int32_t), intent(in) :: hypothesis
    integer, intent(in) :: n_states
    integer(c_int32_t), intent(in), optional :: flags
    character(len=2), parameter :: solid(6) = ['11', '22', '33', '12', '13', '23']
    character(len=1), parameter :: interface(2) = ['n', 't']
    type(c_ptr) :: names
    integer :: f, c, n
    if (the_law%n_formulations >= MAX_FORMULATIONS) return
    the_law%n_formulations = the_law%n_formulations + 1
    f = the_law%n_formulations
    names = c_loc(component_names(1, f))
    if (hypothesis == PILUM_H_INTERFACE_2D) then
      n = 2
      do c = 1, n
        component_names(c, f) = text(interface(c))
      end do
      gradients(f) = variable('jump', '[u]', 'm', &
        'Relative displacement across the interface, opening positive.', PILUM_VECTOR)
      fluxes(f) = variable('traction', 't', 'kPa', 'Traction on the interface, tension positive.', &
        PILUM_VECTOR)
    else
      n = merge(6, 4, hypothesis == PILUM_H_3D)
      do c = 1, n
        component_names(c, f) = text(solid(c))
      end do
      gradients(f) = variable('strain', 'eps', '-', 'Strain, engineering shear.', &
        PILUM_SYMMETRIC_TENSOR)
      fluxes(f) = variable('stress', 'sigma', 'kPa', 'Stress, tension positive.', &
        PILUM_SYMMETRIC_TENSOR)
    end if
    formulations(f) = pilum_formulation(int(c_sizeof(formulations(1)), c_int32_t), hypothesis, 0, &
      1, 1, n_states, c_loc(gradients(f)), c_loc(fluxes(f)), c_loc(states))
    if (present(flags)) formulations(f)%flags = flags

  contains

    type(pilum_variable) function variable(id, symbol, unit, doc, shape)
      character(len=*), intent(in) :: id, symbol, unit, doc
      integer(c_int32_t), intent(in) :: shape
      variable = pilum_variable(int(c_sizeof(variable), c_int32_t), 0, text(id), text(symbol), &
        text(unit), text(doc), shape, n, names, 0.0_dp)
    end function
  end subroutine

  ! What the entry returns once everything is described.
  type(c_ptr) function the_library()
    the_laws(1) = c_loc(the_law)
    the_plugin = pilum_plugin(int(c_sizeof(the_plugin), c_int32_t), 1, c_loc(the_laws), &
      c_null_funptr)
    is_described = .true.
    the_library = c_loc(the_plugin)
  end function

  ! ---- the host's calls --------------------------------------------------------------------------

  function create(law, host, number, parameter, n_parameters, out, message, capacity) &
    result(status) bind(C, name='')
    type(c_ptr), value :: law, host, parameter, out, message
    integer(c_int32_t), value :: number, n_parameters
    integer(c_size_t), value :: capacity
    integer(c_int32_t) :: status
    real(c_double), pointer :: values(:)
    type(c_ptr), pointer :: written
    type(instance_type), pointer :: instance
    character(len=200) :: refusal
    logical :: is_inside
    integer :: i, error
    call say(message, capacity, '')
    status = PILUM_E_ARGUMENT
    if (number < 0 .or. number >= the_law%n_formulations) then
      call say(message, capacity, 'there is no such formulation')
    else if (n_parameters /= the_law%n_parameters .or. .not. c_associated(out) .or. &
      (n_parameters > 0 .and. .not. c_associated(parameter))) then
      call say(message, capacity, 'wrong number of parameters')
    else
      status = PILUM_OK
    end if
    if (status /= PILUM_OK) return
    ! Read as an array only where there is one.
    if (n_parameters > 0) call c_f_pointer(parameter, values, [n_parameters])
    do i = 1, n_parameters
      associate (declared => parameters(i), x => values(i))
        is_inside = is_finite(x) .and. x >= declared%lower .and. x <= declared%upper
        if (iand(declared%flags, PILUM_P_OPEN_LOWER) /= 0) is_inside = is_inside .and. x > declared%lower
        if (iand(declared%flags, PILUM_P_OPEN_UPPER) /= 0) is_inside = is_inside .and. x < declared%upper
        if (.not. is_inside) then
          call say(message, capacity, name_of(declared%id)//': the value is not admissible')
          status = PILUM_E_PARAMETER
          return
        end if
      end associate
    end do
    allocate (instance, stat=error)
    if (error /= 0) then
      call say(message, capacity, 'no memory')
      status = PILUM_E_INTERNAL
      return
    end if
    instance%p = 0
    if (n_parameters > 0) instance%p(:n_parameters) = values
    instance%n_parameters = n_parameters
    instance%n_states = formulations(number + 1)%n_states
    instance%n_components = fluxes(number + 1)%n_components
    refusal = ''
    call the_prepare(instance%p(:n_parameters), refusal)
    if (refusal /= '') then
      call say(message, capacity, trim(refusal))
      deallocate (instance)
      status = PILUM_E_PARAMETER
      return
    end if
    call c_f_pointer(out, written)
    written = c_loc(instance)
  end function

  subroutine destroy(opaque) bind(C, name='')
    type(c_ptr), value :: opaque
    type(instance_type), pointer :: instance
    integer :: error
    if (.not. c_associated(opaque)) return
    call c_f_pointer(opaque, instance)
    deallocate (instance, stat=error)
  end subroutine

  function integrate(opaque, call_of_host) result(worst) bind(C, name='')
    type(c_ptr), value :: opaque, call_of_host
    integer(c_int32_t) :: worst, status
    integer(c_int32_t), parameter :: KNOWN = PILUM_REQ_FLUX + PILUM_REQ_TANGENT + PILUM_REQ_ELASTIC
    type(pilum_batch), pointer :: batch
    type(instance_type), pointer :: instance
    type(point_type) :: point
    type(response_type) :: end
    integer(c_int32_t), pointer :: struct_size, statuses(:)
    real(c_double), pointer :: step_factors(:)
    integer(c_int64_t) :: i
    integer :: tangent, n, m, c, row
    logical :: are_finite, is_null
    worst = PILUM_E_ARGUMENT
    if (.not. c_associated(call_of_host)) return
    call c_f_pointer(call_of_host, struct_size)
    ! The size of version 1.0; later fields are of no use here.
    if (struct_size < 240) return
    call c_f_pointer(call_of_host, batch)
    call say(batch%message, batch%message_capacity, '')
    if (iand(batch%request, not(KNOWN)) /= 0) then
      call say(batch%message, batch%message_capacity, 'an unknown request')
      worst = PILUM_E_UNSUPPORTED
      return
    end if
    if (.not. c_associated(opaque)) then
      call say(batch%message, batch%message_capacity, 'the instance is null')
      return
    end if
    call c_f_pointer(opaque, instance)
    n = instance%n_components
    m = instance%n_states
    tangent = TANGENT_NONE
    if (iand(batch%request, PILUM_REQ_TANGENT) /= 0) tangent = TANGENT_CONSISTENT
    if (iand(batch%request, PILUM_REQ_ELASTIC) /= 0) tangent = TANGENT_ELASTIC
    is_null = .not. (c_associated(batch%gradient0%p) .and. c_associated(batch%gradient1%p) .and. &
      c_associated(batch%flux0%p) .and. c_associated(batch%flux1%p))
    if (m > 0) is_null = is_null .or. .not. c_associated(batch%state0%p) .or. &
      .not. c_associated(batch%state1%p)
    if (tangent /= TANGENT_NONE) is_null = is_null .or. .not. c_associated(batch%tangent%p)
    if (is_null .and. batch%n_points > 0) then
      call say(batch%message, batch%message_capacity, 'a view that is needed is null')
      return
    end if
    nullify (statuses, step_factors)
    if (c_associated(batch%status)) call c_f_pointer(batch%status, statuses, [batch%n_points])
    if (c_associated(batch%step_factor)) &
      call c_f_pointer(batch%step_factor, step_factors, [batch%n_points])
    worst = PILUM_OK
    do i = 0, batch%n_points - 1
      point%n = n
      are_finite = .true.
      do c = 1, n
        point%gradient(c) = element(batch%gradient0%p, batch%gradient0%point, batch%gradient0%component, i, c)
        point%increment(c) = element(batch%gradient1%p, batch%gradient1%point, batch%gradient1%component, i, c) &
          - point%gradient(c)
        point%flux(c) = element(batch%flux0%p, batch%flux0%point, batch%flux0%component, i, c)
        are_finite = are_finite .and. is_finite(point%gradient(c)) .and. &
          is_finite(point%increment(c)) .and. is_finite(point%flux(c))
      end do
      do c = 1, m
        point%state(c) = element(batch%state0%p, batch%state0%point, batch%state0%component, i, c)
        are_finite = are_finite .and. is_finite(point%state(c))
      end do
      point%time = batch%time
      point%time_increment = batch%time_increment
      end%flux = 0
      end%state(:m) = 0
      end%tangent = 0
      end%step_factor = NAN
      if (are_finite) then
        end%reason = 'the law gives no reason'
        status = PILUM_OK
        call the_update(instance%p(:instance%n_parameters), point, tangent, end, status)
      else
        end%reason = 'an input is not finite'
        status = PILUM_E_NUMERIC
      end if
      if (status == PILUM_OK .or. status == PILUM_OK_UNRELIABLE) then
        do c = 1, n
          call put(batch%flux1, i, c, end%flux(c))
        end do
        do c = 1, m
          call put(batch%state1, i, c, end%state(c))
        end do
        if (tangent /= TANGENT_NONE) then
          ! Row by row, where Fortran stores columns.
          do row = 1, n
            do c = 1, n
              call put(batch%tangent, i, (row - 1)*n + c, end%tangent(row, c))
            end do
          end do
        end if
        if (.not. are_finite) then
          end%reason = 'a result is not finite'
          status = PILUM_E_NUMERIC
        end if
      end if
      if (status == PILUM_CUT_STEP .and. associated(step_factors)) &
        step_factors(i + 1) = end%step_factor
      if (is_worse(status, worst)) then
        worst = status
        call point_says(batch, i, end%reason)
      end if
      if (associated(statuses)) statuses(i + 1) = status
      ! A defect of the law is the outcome of all points from there on.
      if (status == PILUM_E_INTERNAL) then
        if (associated(statuses)) statuses(i + 1:) = status
        exit
      end if
    end do

  contains

    subroutine put(view, i, c, x)
      type(pilum_view_mut), intent(in) :: view
      integer(c_int64_t), intent(in) :: i
      integer, intent(in) :: c
      real(dp), intent(in) :: x
      real(dp), pointer :: at
      call locate(view%p, view%point, view%component, i, c, at)
      at = x
      are_finite = are_finite .and. is_finite(x)
    end subroutine
  end function

  ! Whether `a` is a more severe outcome than `b`.
  logical function is_worse(a, b)
    integer(c_int32_t), intent(in) :: a, b
    is_worse = merge(a < b, a > b, a < 0 .or. b < 0)
  end function

  logical function is_finite(x)
    real(dp), intent(in) :: x
    is_finite = abs(x) <= huge(x)
  end function

  ! Component c (from 1) of point i (from 0) of a view; strides count doubles and may be negative.
  real(dp) function element(p, point, component, i, c)
    type(c_ptr), intent(in) :: p
    integer(c_intptr_t), intent(in) :: point, component
    integer(c_int64_t), intent(in) :: i
    integer, intent(in) :: c
    real(dp), pointer :: at
    call locate(p, point, component, i, c, at)
    element = at
  end function

  subroutine locate(p, point, component, i, c, at)
    type(c_ptr), intent(in) :: p
    integer(c_intptr_t), intent(in) :: point, component
    integer(c_int64_t), intent(in) :: i
    integer, intent(in) :: c
    real(dp), pointer, intent(out) :: at
    integer(c_intptr_t) :: address
    address = transfer(p, address) + 8*(i*point + (c - 1)*component)
    call c_f_pointer(transfer(address, c_null_ptr), at)
  end subroutine

  ! ---- texts, without the I/O of Fortran, which allocates ----------------------------------------

  ! Keeps a text, NUL-terminated, for the life of the process.
  type(c_ptr) function text(given)
    character(len=*), intent(in) :: given
    integer :: i, start
    if (n_texts + len(given) + 1 > size(texts)) then
      text = c_loc(texts(n_texts))
      return
    end if
    start = n_texts + 1
    do i = 1, len(given)
      texts(n_texts + i) = given(i:i)
    end do
    n_texts = n_texts + len(given) + 1
    texts(n_texts) = c_null_char
    text = c_loc(texts(start))
  end function

  ! The kept text at an address.
  function name_of(p) result(name)
    type(c_ptr), intent(in) :: p
    character(len=:), allocatable :: name
    character(kind=c_char), pointer :: letters(:)
    integer :: n, i
    call c_f_pointer(p, letters, [size(texts)])
    n = 0
    do while (letters(n + 1) /= c_null_char)
      n = n + 1
    end do
    allocate (character(len=n) :: name)
    do i = 1, n
      name(i:i) = letters(i)
    end do
  end function

  ! Writes a message, cut short to the buffer, which may be null.
  subroutine say(message, capacity, given)
    type(c_ptr), intent(in) :: message
    integer(c_size_t), intent(in) :: capacity
    character(len=*), intent(in) :: given
    character(kind=c_char), pointer :: buffer(:)
    integer :: i, n
    if (.not. c_associated(message) .or. capacity < 1) return
    call c_f_pointer(message, buffer, [capacity])
    n = int(min(int(len(given), c_size_t), capacity - 1))
    do i = 1, n
      buffer(i) = given(i:i)
    end do
    buffer(n + 1) = c_null_char
  end subroutine

  ! Writes `point <number>: <reason>`.
  subroutine point_says(batch, i, reason)
    type(pilum_batch), intent(in) :: batch
    integer(c_int64_t), intent(in) :: i
    character(len=*), intent(in) :: reason
    character(len=20) :: digits
    character(len=160) :: line
    integer(c_int64_t) :: rest
    integer :: k, n
    rest = batch%first_point + i
    k = len(digits) + 1
    do
      k = k - 1
      digits(k:k) = achar(iachar('0') + int(mod(rest, 10_c_int64_t)))
      rest = rest/10
      if (rest == 0) exit
    end do
    ! Piece by piece: a concatenation of unknown length would be allocated.
    n = len(digits) - k + 1
    line(:6) = 'point '
    line(7:6 + n) = digits(k:)
    line(7 + n:8 + n) = ': '
    line(9 + n:) = reason
    call say(batch%message, batch%message_capacity, line(:len_trim(line)))
  end subroutine
end module
