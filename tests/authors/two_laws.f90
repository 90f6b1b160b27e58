! Two laws in one library: one with a choice and no internal variables, in the plane and in space, one
! without parameters.
module two_laws
  use pilum
  implicit none

contains

  subroutine describe()
    call describe_law(id='spring_fortran', name='elastic interface', version='1.0', &
      author='The Pilum authors', licence='MIT OR Apache-2.0', doc='Elastic.', references='none', &
      prepare=prepare, update=spring)
    call add_parameter('kind', '-', '-', 'How stiff it is.', choices=['soft ', 'stiff'], &
      default=0.0_dp)
    call add_parameter('factor', 'f', '-', 'Factor on the stiffness; 1 if left out.', &
      above=0.0_dp, usual=[0.1_dp, 10.0_dp], optional=.true.)
    call add_formulation(PILUM_H_INTERFACE_2D, 0, flags=PILUM_T_LINEAR)
    call add_formulation(PILUM_H_INTERFACE_3D, 0, flags=PILUM_T_LINEAR)

    call describe_law(id='counter_fortran', name='stiff interface', version='2.0', &
      author='The Pilum authors', licence='MIT OR Apache-2.0', &
      doc='Elastic; counts how far it has moved from 7 on.', references='none', &
      prepare=nothing, update=counter)
    call add_state(1, 'travel', 's', 'm', 'Sum of all movements.', initial=7.0_dp)
    call add_formulation(PILUM_H_INTERFACE_2D, 1)
  end subroutine

  ! The stiffness from there on.
  subroutine prepare(p, refusal)
    real(dp), intent(inout) :: p(:)
    character(len=*), intent(inout) :: refusal
    p(1) = merge(1e6_dp, 1e3_dp, p(1) > 0.5_dp)
    if (.not. is_nan(p(2))) p(1) = p(1)*p(2)
  end subroutine

  subroutine nothing(p, refusal)
    real(dp), intent(inout) :: p(:)
    character(len=*), intent(inout) :: refusal
  end subroutine

  subroutine spring(p, point, tangent, end, status)
    real(dp), intent(in) :: p(:)
    type(point_type), intent(in) :: point
    integer, intent(in) :: tangent
    type(response_type), intent(inout) :: end
    integer(c_int32_t), intent(inout) :: status
    call elastic(p(1), point, end)
  end subroutine

  subroutine counter(p, point, tangent, end, status)
    real(dp), intent(in) :: p(:)
    type(point_type), intent(in) :: point
    integer, intent(in) :: tangent
    type(response_type), intent(inout) :: end
    integer(c_int32_t), intent(inout) :: status
    call elastic(1e5_dp, point, end)
    end%state(1) = point%state(1) + sum(abs(point%increment))
  end subroutine

  subroutine elastic(k, point, end)
    real(dp), intent(in) :: k
    type(point_type), intent(in) :: point
    type(response_type), intent(inout) :: end
    integer :: i
    end%flux = point%flux + k*point%increment
    do i = 1, size(point%flux)
      end%tangent(i, i) = k
    end do
  end subroutine
end module

function pilum_entry(host) result(library) bind(C, name='pilum_entry')
  use two_laws
  implicit none
  type(c_ptr), value :: host
  type(c_ptr) :: library
  if (.not. described()) call describe()
  library = the_library()
end function
